# SPDX-License-Identifier: GPL-3.0-or-later
"""The runtime of a process that computes: threads and memory, before NumPy and torch are loaded."""

import contextlib
import ctypes
import os
import sys

THREADS = "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of <malloc.h>
KEPT_BYTES = 256 << 20  # bytes of freed memory that the process keeps
LARGEST_BLOCK = 32 << 20  # bytes of a piece of it; the most that glibc allows


def set_up() -> None:
    """Have the libraries below start no threads of their own, and keep freed memory.

    The libraries' own threads only stall each other when Blender is busy, and LAPACK's even when it
    is not. glibc gives freed memory back at once and asks for it anew for each matrix: four times
    the page faults of wide strokes, which take 2 % more processor time; other work takes the same.
    """
    os.environ.update(dict.fromkeys(THREADS, "1"))
    if sys.platform == "linux":
        with contextlib.suppress(AttributeError, OSError):  # another C library
            libc = ctypes.CDLL(None)
            libc.mallopt(M_MMAP_THRESHOLD, LARGEST_BLOCK)
            libc.mallopt(M_TRIM_THRESHOLD, KEPT_BYTES)
