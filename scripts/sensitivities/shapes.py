# SPDX-License-Identifier: GPL-3.0-or-later
"""Held-out meshes: generated, and no benchmark has them.

Vertices (V, 3), in any unit, and triangles (F, 3), counter-clockwise seen from outside but where
something is wrong on purpose.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

Mesh = tuple[NDArray[np.float64], NDArray[Any]]


def ripples() -> Mesh:
    """A smooth ball whose waves become shorter from one end to the other."""
    vertices, triangles = ball(1.0, 6)
    x, y, z = vertices.T
    waves = np.sin(6 * (z + 1.6) ** 2.2) * np.cos(2 * np.arctan2(y, x))
    return vertices * (1 + 0.03 * waves[:, None]), triangles


def knot() -> Mesh:
    """A trefoil of a thin tube, and a bead beside it."""
    around, across = 240, 32
    t = np.linspace(0, 2 * np.pi, around, endpoint=False)
    line = np.stack(
        [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1
    )
    ahead = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0)
    side = np.cross(ahead, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, ahead)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    turn = np.linspace(0, 2 * np.pi, across, endpoint=False)[:, None]
    tube = line[:, None] + 0.35 * (
        np.cos(turn) * side[:, None] + np.sin(turn) * up[:, None]
    )  # (around, across, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    triangles = np.concatenate(
        [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (a, c, d))]
    )
    return joined(outward((tube.reshape(-1, 3), triangles)), moved(ball(0.25, 3), (0, 0, 0.2)))


def bracket() -> Mesh:
    """Two thin plates and a pin that stick into each other."""
    pin = trimesh.creation.cylinder(0.2, 0.9, sections=48)
    return joined(
        box((1.6, 1.0, 0.08)),
        moved(box((0.08, 1.0, 0.9)), (-0.7, 0, 0.4)),
        moved((np.array(pin.vertices), np.array(pin.faces)), (0.3, 0, 0.3)),
    )


class Solid(NamedTuple):
    """A mesh and what it bounds.

    inside: which of points (N, 3) are in it
    """

    make: Callable[[], Mesh]
    inside: Callable[[NDArray[np.float64]], NDArray[np.bool_]]
    thickness: float | None = None


def opened() -> Mesh:
    """A ball with a hole, a third of it wound the other way."""
    vertices, triangles = ball(1.0, 4)
    left = vertices[triangles].mean(axis=1)[:, 2] < 0.9
    turned = np.random.default_rng(8).random(len(triangles)) < 0.3
    return vertices, np.where(turned[:, None], triangles[:, ::-1], triangles)[left]


def hollow() -> Mesh:
    """A ball with a cavity, and a ball in that."""
    vertices, triangles = ball(0.6, 4)
    return joined(ball(1.0, 4), (vertices, triangles[:, ::-1]), ball(0.3, 3))


def stack() -> Mesh:
    """Boxes that stick into each other, one of them all inside of another."""
    return joined(
        box((1.0, 1.0, 1.0)),
        moved(box((1.6, 0.4, 0.4)), (0.1, 0.05, 0.13)),
        moved(box((0.3, 0.3, 1.7)), (-0.2, 0.1, 0.2)),
        box((0.5, 0.5, 0.5)),
    )


def crossed() -> Mesh:
    """Two balls of small triangles that stick into each other, of random vertices."""
    noise = np.random.default_rng(9).normal(0, 5e-4, (2562, 3))
    vertices, triangles = ball(0.7, 4)
    other = vertices + [0.6, 0.1, 0.0]
    return joined((vertices + noise, triangles), (other + noise, triangles))


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
    return joined(ball(1.0, 4), fin)


def _within(*parts: tuple[tuple[float, ...], tuple[float, ...]]) -> Callable:
    """Which points are in one of some boxes, by their middles and sizes."""

    def inside(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.any(
            [(np.abs(points - at) < np.array(size) / 2).all(axis=1) for at, size in parts], axis=0
        )

    return inside


def _radius(points: NDArray[np.float64], at: tuple[float, ...] = (0, 0, 0)) -> NDArray[np.float64]:
    return np.linalg.norm(points - at, axis=1)


SMOOTH = {"ripples": ripples, "knot": knot, "bracket": bracket}
"""What fits are measured by."""

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
}
"""Meshes of which it is known what they bound, though something is wrong with them."""


def ball(radius: float, subdivisions: int) -> Mesh:
    """A sphere."""
    mesh = trimesh.creation.icosphere(subdivisions, radius)
    return np.array(mesh.vertices), np.array(mesh.faces)


def box(size: tuple[float, ...]) -> Mesh:
    """A box of twelve triangles."""
    mesh = trimesh.creation.box(size)
    return np.array(mesh.vertices), np.array(mesh.faces)


def moved(mesh: Mesh, way: tuple[float, ...]) -> Mesh:
    """A mesh elsewhere."""
    return mesh[0] + way, mesh[1]


def outward(mesh: Mesh) -> Mesh:
    """A closed mesh whose faces look outward."""
    a, b, c = np.moveaxis(mesh[0][mesh[1]], 1, 0)
    volume = np.einsum("fi,fi->", a, np.cross(b, c))
    return mesh[0], mesh[1] if volume > 0 else mesh[1][:, ::-1]


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    faces = [face + start for (_, face), start in zip(meshes, starts, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)
