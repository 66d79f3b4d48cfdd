# SPDX-License-Identifier: GPL-3.0-or-later
"""Connected components of a proxy, and islands: those that no stroke asked for (docs/method.md,
section 4.4).

Where no sample holds it, an edit can let the field change its sign: islands outside of the shape,
bubbles inside. A component is one of these when too few samples of the surface asked for are
nearest to it. A small one is, too, when it was torn off another one, for a stroke displaces the
surface and tears nothing off. Model space.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..geometry import search_tree
from .components import signed_volumes
from .proxy import Proxy

MATCHED = 0.25  # of the samples that a piece of its size would attract, if it were asked for
LEAST = 0.01  # distance that is asked for where an island was, however near the surface it was
CRUMB = 50  # vertices; a smaller piece of what was one piece was torn off, not cut off
AT_OLD_SURFACE = 5e-3
"""How near to an untouched sample a piece comes that has some of the old surface."""


def components(proxy: Proxy) -> int:
    """How many pieces a proxy has."""
    return proxy.components.total


class Islands(NamedTuple):
    """Vertices of pieces that nobody asked for, and what the field shall be there."""

    points: NDArray[np.float32]  # (N, 3)
    distance: NDArray[np.float64]  # (N,), signed, from the surface asked for; at least LEAST


class Asked(NamedTuple):
    """Samples of the surface that an edit asks for, and what was there."""

    displaced: NDArray[np.float32]  # (M, 3)
    held: NDArray[np.float32]  # (N, 3), vertices before that are untouched
    before: Proxy

    @property
    def points(self) -> NDArray[np.float32]:
        """All of them (M + N, 3)."""
        return np.concatenate([self.displaced, self.held])


def find_islands(proxy: Proxy, asked: Asked) -> Islands:
    """The islands and bubbles of `proxy`.

    A piece that was asked for has its share of the samples nearest to it, and some that are held
    among them, unless the stroke covers a whole piece of the shape.
    """
    count, labels = proxy.components
    if count == 1:
        return Islands(np.empty((0, 3), np.float32), np.empty(0))
    tree = search_tree(proxy.vertices)
    everywhere = asked.points
    attracted = np.bincount(labels[tree.query(everywhere)[1]], minlength=count) / len(everywhere)
    size = np.bincount(labels, minlength=count)
    spurious = attracted < MATCHED * size / len(labels)
    known = asked.before.components
    held = known.labels[search_tree(asked.before.vertices).query(asked.held)[1]]
    if len(np.unique(held)) == known.total:
        distance, nearest = tree.query(asked.held, distance_upper_bound=AT_OLD_SURFACE)
        near = np.isfinite(distance)
        shared = np.zeros((known.total, count), int)  # samples, of old pieces and new ones
        np.add.at(shared, (held[near], labels[np.asarray(nearest)[near]]), 1)
        small = size < CRUMB
        small[shared.argmax(axis=1)] = False
        spurious |= small | ~shared.any(axis=0)
    chosen = spurious[labels]
    points = proxy.vertices[chosen]
    volumes = signed_volumes(proxy.vertices, proxy.triangles, labels, count)
    distance = (
        np.maximum(search_tree(everywhere).query(points)[0], LEAST)
        * np.where(volumes > 0, 1, -1)[labels[chosen]]
    )
    return Islands(points, distance)
