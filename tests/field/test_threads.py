# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool of threads."""

import threading

import numpy as np
import pytest
import torch

from neural_sculpt_addon.common.errors import Cancelled
from neural_sculpt_addon.field.threads import (
    PIECE,
    in_pieces,
    one_thread,
    parallel,
    pool,
    shares,
    threads,
)


def test_its_threads_leave_torch_one_thread_each():
    found = set(pool().map(lambda _: (torch.get_num_threads(), threading.get_ident()), range(32)))
    assert {threads for threads, _ in found} == {1}
    assert threading.get_ident() not in {thread for _, thread in found}


def test_pieces_are_joined_in_order():
    numbers = np.arange(3 * PIECE + 5)

    def task(part):
        return numbers[part], (numbers[part, None] * [1, 2], numbers[part] > 7)

    same, (pairs, large) = in_pieces(task, len(numbers))
    np.testing.assert_array_equal(same, numbers)
    np.testing.assert_array_equal(pairs, numbers[:, None] * [1, 2])
    np.testing.assert_array_equal(large, numbers > 7)
    assert in_pieces(lambda part: numbers[:0][part], 0).shape == (0,)


@pytest.mark.parametrize("light", [False, True])
@pytest.mark.parametrize("count", [1, 32, 33, 64, 65, 1000])
def test_no_piece_is_larger_than_asked_for(count, light):
    def task(part):
        return np.full(part.stop - part.start, part.stop - part.start)

    sizes = in_pieces(task, count, light=light, size=32)
    assert len(sizes) == count and sizes.max() <= 32


@pytest.mark.parametrize("count", [PIECE + 1, 3 * PIECE, 5 * PIECE + 7])
def test_two_threads_do_as_much_each(count):
    sizes = [part.stop - part.start for part in shares(count, PIECE)]
    assert sum(sizes) == count and max(sizes) <= PIECE
    assert len(sizes) % 2 == 0 and max(sizes) - min(sizes) <= 1


def test_few_points_are_one_part():
    assert shares(PIECE, PIECE) == [slice(0, PIECE)] and shares(0, PIECE) == []


@pytest.mark.parametrize("light", [False, True])
@pytest.mark.parametrize("last", [0, 1, 4])
def test_a_cancel_is_heard_before_each_piece(last, light):
    calls, done = [], []

    def check():
        calls.append(None)
        if len(calls) > last:
            raise Cancelled

    def task(part):
        done.append(part)
        return np.arange(3)

    with pytest.raises(Cancelled):
        in_pieces(task, (10 + 4 * threads()) * PIECE, check, light=light)
    assert len(calls) == last + 1
    assert len(done) < last + 2 * threads()  # which are given out ahead


def test_one_thread_is_left_again():
    before = torch.get_num_threads()
    with pytest.raises(Cancelled), one_thread():
        assert torch.get_num_threads() == 1
        raise Cancelled
    assert torch.get_num_threads() == before


def test_a_parallel_map_keeps_the_order_and_may_be_nested():
    def nested(number):
        return parallel(lambda k: k * number, range(3))

    expected = [[0, number, 2 * number] for number in range(40)]
    assert parallel(nested, range(40)) == expected
