# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool of threads."""

import threading

import torch

from neural_sculpt_addon.field.threads import pool


def test_its_threads_leave_torch_one_thread_each():
    found = set(pool().map(lambda _: (torch.get_num_threads(), threading.get_ident()), range(32)))
    assert {threads for threads, _ in found} == {1}
    assert threading.get_ident() not in {thread for _, thread in found}


def test_there_is_one():
    assert pool() is pool()
