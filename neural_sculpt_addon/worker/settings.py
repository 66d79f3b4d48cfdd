# SPDX-License-Identifier: GPL-3.0-or-later
"""What a process that computes asks of the libraries below, before it loads NumPy and torch."""

import contextlib
import ctypes
import os
import sys

THREADS = "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"
CACHES = "ONEDNN_PRIMITIVE_CACHE_CAPACITY", "LRU_CACHE_CAPACITY"  # oneDNN's own and torch's for it
SHAPES = 224  # kept as machine code: in each of two widths 75 of quick and 23 of refining
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of <malloc.h>
KEPT = 256 << 20  # bytes of freed memory that the process keeps
LARGEST = 32 << 20  # bytes of a piece of it; the most that glibc allows


def settle() -> None:
    """No threads but ours, freed memory kept, and little machine code.

    The libraries' own threads only stall each other when Blender is busy, and LAPACK's even when it
    is not. glibc gives freed memory back at once and asks for it anew for each matrix, which took
    a tenth of a refinement's time. oneDNN compiles each product of bfloat16 for the shape that it
    has and keeps 1024 of them, which can take 700 MB; with too few, quick would take half as long
    again.
    """
    os.environ.update(dict.fromkeys(THREADS, "1"))
    os.environ.update(dict.fromkeys(CACHES, str(SHAPES)))
    if sys.platform == "linux":
        with contextlib.suppress(AttributeError, OSError):  # another C library
            libc = ctypes.CDLL(None)
            libc.mallopt(M_MMAP_THRESHOLD, LARGEST)
            libc.mallopt(M_TRIM_THRESHOLD, KEPT)
