# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bounded cache keeps and forgets."""

from neural_sculpt_addon.worker.server.cache import Cache


def test_what_was_not_asked_for_longest_is_forgotten_first():
    cache: Cache[str, bytes] = Cache(10, len)
    cache["a"], cache["b"] = b"aaaa", b"bbbb"
    assert cache["a"] == b"aaaa"
    cache["c"] = b"cccc"
    assert dict(cache) == {"a": b"aaaa", "c": b"cccc"}


def test_the_latest_is_there_however_large():
    cache: Cache[str, bytes] = Cache(10, len)
    cache["a"] = b"a"
    cache["b"] = bytes(100)
    assert list(cache) == ["b"]
    cache["c"] = b"c"
    assert list(cache) == ["c"]


def test_what_is_replaced_or_removed_takes_no_room():
    cache: Cache[str, bytes] = Cache(10, len)
    for _ in range(5):
        cache["a"] = b"aaaa"
    cache["b"] = b"bbbbbb"
    assert list(cache) == ["a", "b"]
    del cache["a"]
    cache["c"] = b"cccc"
    assert list(cache) == ["b", "c"]
