# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as they come in bad files, made from a good one; mesh space is that of the good one.

Each variant is a function (vertices (V, 3), triangles (F, 3), random numbers) -> the same two
arrays, damaged.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Mesh = tuple[NDArray[Any], NDArray[Any]]
Damage = Callable[[NDArray, NDArray, np.random.Generator], Mesh]

MILLION = 1_000_000


def holes(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """5 % of the faces deleted."""
    return v, f[rng.random(len(f)) > 0.05]


def open_bottom(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """The lowest tenth cut away."""
    up = np.argmax(np.ptp(v, axis=0))
    height = v[f].mean(axis=1)[:, up]
    return v, f[height > v[:, up].min() + 0.1 * np.ptp(v[:, up])]


def flipped(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """Inside out."""
    return v, f[:, ::-1]


def mixed(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """30 % of the faces wound the other way."""
    turned = rng.random(len(f)) < 0.3
    return v, np.where(turned[:, None], f[:, ::-1], f)


def soup(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """No two faces share a vertex, and 30 % are wound the other way."""
    return mixed(v[f].reshape(-1, 3), np.arange(3 * len(f)).reshape(-1, 3), rng)


def noisy(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """Vertices off by 0.2 % of the size, so that faces of a fine mesh cut each other."""
    return v + 0.002 * np.ptp(v, axis=0).max() * rng.standard_normal(v.shape), f


def doubled(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """Every third face twice, once of them turned; every tenth collapsed to an edge as well."""
    return v, np.concatenate([f, f[::3, ::-1], f[::10, [0, 1, 1]]])


def walled(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """A ball of walls inside: the shape again, at a fifth of its size."""
    middle = v.mean(axis=0)
    return joined((v, f), (middle + 0.2 * (v - middle), f))


def overlapping(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """Itself again, moved by a fifth of its size."""
    return joined((v, f), (v + 0.2 * np.ptp(v, axis=0) * [1, 0, 0], f))


def crowd(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """Eight of it, apart."""
    step = 1.3 * np.ptp(v, axis=0)
    corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), axis=-1).reshape(-1, 3)
    return joined(*((v + step * corner, f) for corner in corners))


def tiny(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """1e-4 of its size."""
    return v * 1e-4, f


def huge(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """1e6 times its size."""
    return v * 1e6, f


def far(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """A thousand sizes from the origin."""
    return v + 1000 * np.ptp(v, axis=0).max(), f


def million(v: NDArray, f: NDArray, rng: np.random.Generator) -> Mesh:
    """Divided into a million triangles or more."""
    while len(f) < MILLION:
        a, b, c = np.moveaxis(v[f], 1, 0)
        v = np.stack([a, b, c, (a + b) / 2, (b + c) / 2, (c + a) / 2], axis=1)  # (F, 6, 3)
        quarters = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
        f = (6 * np.arange(len(v))[:, None, None] + quarters).reshape(-1, 3)
        v = v.reshape(-1, 3)
    return v, f


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


DAMAGES: dict[str, Damage] = {
    damage.__name__: damage
    for damage in (
        *(holes, open_bottom, flipped, mixed, soup, noisy, doubled, walled, overlapping, crowd),
        *(tiny, huge, far, million),
    )
}
IN_PLACE = ("holes", "flipped", "mixed", "soup", "doubled", "walled", "million")
"""Damages after which the shape is still there, where it was."""


def sheet() -> Mesh:
    """A wavy square."""
    line = np.linspace(-1, 1, 24)
    x, y = np.meshgrid(line, line, indexing="ij")
    v = np.stack([x, y, 0.1 * np.sin(3 * x) * np.cos(2 * y)], axis=-1).reshape(-1, 3)
    corner = (24 * np.arange(23)[:, None] + np.arange(23)).ravel()
    first, second = corner[:, None] + [0, 24, 25], corner[:, None] + [0, 25, 1]
    return v, np.concatenate([first, second])


def _tetrahedron() -> Mesh:
    v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    return v, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def _hopeless() -> dict[str, Mesh]:
    v, f = _tetrahedron()
    roof, tiles = sheet()
    return {
        "empty": (np.zeros((0, 3)), np.zeros((0, 3), np.int64)),
        "no faces": (v, np.zeros((0, 3), np.int64)),
        "NaN": (np.where(v == 1, np.nan, v), f),
        "a point": (0 * v, f),
        "a line": (v * [1, 0, 0], f),
        "plane": (v[:3], f[:1]),
        "sheet": (roof, tiles),
        "solid and sheet": joined((v, f), (0.3 * roof + 2, tiles)),
        "far away": ((v + 1e5).astype(np.float32), f),
    }


HOPELESS: dict[str, Mesh] = _hopeless()
"""What has no inside, or none that could be found: each is refused with a sentence."""
