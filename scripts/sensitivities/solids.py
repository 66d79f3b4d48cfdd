# SPDX-License-Identifier: GPL-3.0-or-later
"""Held-out meshes with something wrong on purpose, of which it is known what they bound."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from benchmarking.awkward_meshes import ball, box
from benchmarking.damaged_meshes import Mesh, joined
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

TURN = Rotation.from_rotvec((0.7, -0.4, 1.1)).as_matrix()  # of what touches


class Solid(NamedTuple):
    """A mesh and what it bounds.

    inside: which of points (N, 3) are in it
    """

    make: Callable[[], Mesh]
    inside: Callable[[NDArray[np.float64]], NDArray[np.bool_]]
    thickness: float | None = None


def opened() -> Mesh:
    """A ball with a hole, a third of it wound the other way."""
    vertices, triangles = ball(1.0)
    left = vertices[triangles].mean(axis=1)[:, 2] < 0.9
    turned = np.random.default_rng(8).random(len(triangles)) < 0.3
    return vertices, np.where(turned[:, None], triangles[:, ::-1], triangles)[left]


def hollow() -> Mesh:
    """A ball with a cavity, and a ball in that."""
    return joined(ball(1.0), ball(0.6, -1), ball(0.3, fine=3))


def stack() -> Mesh:
    """Boxes that stick into each other, one of them all inside of another."""
    return joined(
        box((1.0, 1.0, 1.0)),
        box((1.6, 0.4, 0.4), (0.1, 0.05, 0.13)),
        box((0.3, 0.3, 1.7), (-0.2, 0.1, 0.2)),
        box((0.5, 0.5, 0.5)),
    )


def crossed() -> Mesh:
    """Two balls of small triangles that stick into each other, of random vertices."""
    noise = np.random.default_rng(9).normal(0, 5e-4, (2562, 3))
    vertices, triangles = ball(0.7)
    mesh = vertices + noise, triangles
    return joined(mesh, (mesh[0] + (0.6, 0.1, 0.0), triangles))


def sheet() -> Mesh:
    """A round sheet."""
    x, y = (each.ravel() for each in np.meshgrid(*[np.linspace(-1, 1, 41)] * 2, indexing="ij"))
    i, j = (each.ravel() for each in np.meshgrid(*[np.arange(40)] * 2, indexing="ij"))
    a, b, c, d = 41 * i + j, 41 * (i + 1) + j, 41 * (i + 1) + j + 1, 41 * i + j + 1
    triangles = np.concatenate([np.stack(each, axis=1) for each in ((a, b, c), (a, c, d))])
    return np.stack([x, y, np.zeros(len(x))], axis=1), triangles


def finned() -> Mesh:
    """A ball with a small open sheet that stands on it."""
    fin = np.array([[0, 0, 0.97], [0.15, 0, 1.15], [-0.15, 0, 1.15]]), np.array([[0, 1, 2]])
    return joined(ball(1.0), fin)


def touching() -> Mesh:
    """A box upon another one, turned: by rounding their faces cross here and there."""
    vertices, triangles = joined(box((0.8, 0.9, 0.7)), box((0.5, 0.4, 0.3), (0.65, 0, 0)))
    return vertices @ TURN.T, triangles


def _within(*parts: tuple[tuple[float, ...], tuple[float, ...]]) -> Callable:
    """Which points are in one of some boxes, by their middles and sizes."""

    def inside(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.any(
            [(np.abs(points - at) < np.array(size) / 2).all(axis=1) for at, size in parts], axis=0
        )

    return inside


def _radius(points: NDArray[np.float64], at: tuple[float, ...] = (0, 0, 0)) -> NDArray[np.float64]:
    return np.linalg.norm(points - at, axis=1)


SOLIDS = {
    "opened": Solid(opened, lambda p: (_radius(p) < 1) & (p[:, 2] < 0.9)),
    "hollow": Solid(hollow, lambda p: (_radius(p) < 1) & (_radius(p) > 0.6) | (_radius(p) < 0.3)),
    "stack": Solid(
        stack,
        _within(
            ((0, 0, 0), (1, 1, 1)),
            ((0.1, 0.05, 0.13), (1.6, 0.4, 0.4)),
            ((-0.2, 0.1, 0.2), (0.3, 0.3, 1.7)),
        ),
    ),
    "crossed": Solid(crossed, lambda p: (_radius(p) < 0.7) | (_radius(p, (0.6, 0.1, 0)) < 0.7)),
    "sheet": Solid(sheet, _within(((0, 0, 0), (2.1, 2.1, 0.1))), 0.1),
    "finned": Solid(finned, lambda p: _radius(p) < 1),
    "touching": Solid(
        touching,
        lambda p: _within(((0, 0, 0), (0.8, 0.9, 0.7)), ((0.65, 0, 0), (0.5, 0.4, 0.3)))(p @ TURN),
    ),
}
