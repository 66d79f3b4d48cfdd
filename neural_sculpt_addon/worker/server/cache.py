# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache of bounded size in bytes. What has not been asked for longest is forgotten first."""

from collections import OrderedDict
from collections.abc import Callable, Iterator, MutableMapping
from typing import TypeVar

K = TypeVar("K")
V = TypeVar("V")


class Cache(MutableMapping[K, V]):
    """A cache of bounded size: forgets what has not been asked for longest, but never what was put
    last."""

    def __init__(self, most: int, size: Callable[[V], int]) -> None:
        """Hold at most so many bytes; a value takes `size`(value) of them."""
        self._most, self._size, self._bytes = most, size, 0
        self._items: OrderedDict[K, tuple[V, int]] = OrderedDict()

    def __getitem__(self, key: K) -> V:
        value = self._items[key][0]
        self._items.move_to_end(key)
        return value

    def __setitem__(self, key: K, value: V) -> None:
        self.pop(key, None)
        size = self._size(value)
        self._items[key] = value, size
        self._bytes += size
        while self._bytes > self._most and len(self._items) > 1:
            del self[next(iter(self._items))]

    def __delitem__(self, key: K) -> None:
        self._bytes -= self._items.pop(key)[1]

    def __contains__(self, key: object) -> bool:
        return key in self._items

    def __iter__(self) -> Iterator[K]:
        return iter(list(self._items))

    def __len__(self) -> int:
        return len(self._items)
