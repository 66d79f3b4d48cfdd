# SPDX-License-Identifier: GPL-3.0-or-later
"""A pool of threads with one torch thread each, for work in parts that fit the cache.

Contended OpenMP regions stall for seconds when Blender is busy; single-threaded parts do not.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import torch

MOST = 8


@cache
def pool() -> ThreadPoolExecutor:
    """The one pool. Its tasks must not wait for tasks of their own."""
    return ThreadPoolExecutor(
        min(MOST, os.cpu_count() or 1), "field", initializer=torch.set_num_threads, initargs=(1,)
    )
