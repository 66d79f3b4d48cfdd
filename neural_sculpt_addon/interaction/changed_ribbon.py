# SPDX-License-Identifier: GPL-3.0-or-later
"""The ribbon of a stroke of the history with other settings, on the surface that it is part of.

The surface shown includes the stroke as it was. The old displacement is taken away from it and the
new one added, so the ribbon lies where the surface will be, and below the shown one where that will
sink. `Lay` is as for ribbons. NumPy alone; model space.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..stroke.curve import Array, fit_curve
from ..stroke.displacement import displace, local_radius
from ..stroke.path import Path, make_path
from ..stroke.stroke import Direction, Kind, Stroke
from .ribbon import ACROSS, ALONG, LIFT, Lay, Ribbon

PAST_BOTH = 1.2  # radii of the wider of both strokes: neither has moved the surface there
STEPS = 3  # towards the surface without the stroke, each of which leaves a part of the way


class _Strip(NamedTuple):
    """A strip of the tangent planes along the stroke; around a dab its rows are diameters."""

    path: Path
    points: Array  # (ALONG, ACROSS, 3)
    normals: Array  # (ALONG, ACROSS, 3), of the surface


def changed_ribbons(
    old: Stroke, new: Stroke, lay: Lay, shown: float = 1.0, strength: float = 1.0
) -> tuple[Ribbon, ...]:
    """The ribbon of the new stroke and those of its images. Where it runs on the flank of the old
    one through other points, it leans with that.

    shown:    share of the old stroke that the surface shows
    strength: share of the new one that it will show
    """
    wide = PAST_BOTH * max(s.largest_radius for s in (old, new))
    path, points, normals = _strip(new, wide, lay)
    alike = old.closed == new.closed and np.array_equal(old.points, new.points)
    other = None if alike else _strip(old, wide, lay).path
    for _ in range(STEPS):
        before = other or path
        now = points + shown * _amounts(old, before, points, normals)[..., None] * normals
        off = lay(now.reshape(-1, 3))[0].reshape(now.shape) - now
        points += (off * normals).sum(axis=-1, keepdims=True) * normals
        middle = points[: len(path.points), ACROSS // 2]  # between control points far apart, too
        path = make_path(middle, path.normals, path.closed)
    points, normals = _finer(points), _unit(_finer(normals))
    amount = strength * _amounts(new, path, points, normals)
    points += (amount + LIFT)[..., None] * normals
    modulated = np.abs(new.brush.modulation(path.u))
    modulated = np.broadcast_to(modulated / max(modulated.max(), 1.0), ALONG)
    return tuple(Ribbon(points @ image.T, amount, modulated) for image in new.images)


def _amounts(stroke: Stroke, path: Path, points: Array, normals: Array) -> Array:
    """By how much (R, C) the stroke displaces points (R, C, 3); by nothing if it does not draw."""
    if stroke.kind is not Kind.DRAW:
        return np.zeros(points.shape[:2])
    plain = replace(stroke, brush=replace(stroke.brush, alpha=None))  # finer than a ribbon
    moved = displace(plain, path, points.reshape(-1, 3), normals.reshape(-1, 3))
    return moved.amount.reshape(points.shape[:2])


def _strip(stroke: Stroke, wide: float, lay: Lay) -> _Strip:
    """A strip as wide as the stroke, on normals found `wide` to both sides of its middle."""
    curve = fit_curve(stroke.points, stroke.closed)
    line = curve.resample(ALONG)[0] if len(curve.points) > 1 else curve.points[:1]
    path = make_path(line, lay(line)[1], curve.closed)
    for _ in range(2):  # the normals of a ridge's flanks lead to those beside it
        _, left, right = _beside(path, wide, lay)
        normals = left + right
        if len(line) == 1:
            normals = normals.sum(axis=0, keepdims=True)
        path = make_path(line, normals, curve.closed)
    laterals, left, right = _beside(path, wide, lay)
    v = np.linspace(-1, 1, ACROSS)
    across = local_radius(stroke, path.u)[:, None] * v  # (R, C) or (1, C)
    points = path.points[:, None] + across[..., None] * laterals[:, None]
    if stroke.direction is Direction.STROKE:
        turned = np.broadcast_to(path.normals[:, None], points.shape)
    else:
        share = (1 + across / wide)[..., None] / 2
        turned = _unit(share * left[:, None] + (1 - share) * right[:, None])
    return _Strip(path, points, turned)


def _beside(path: Path, wide: float, lay: Lay) -> tuple[Array, Array, Array]:
    """The unit vectors (ALONG, 3) across the path, and the surface's normals there to the left and
    to the right of it (ALONG, 3); those across a dab go half around it."""
    laterals = path.laterals
    if len(path.points) == 1:
        angle = np.linspace(0, np.pi, ALONG)[:, None]
        laterals = np.cos(angle) * laterals + np.sin(angle) * path.tangents
    left, right = (lay(path.points + side * wide * laterals)[1] for side in (1, -1))
    return laterals, left, right


def _finer(vectors: Array) -> Array:
    """Vectors (R, C, 3) with the means of neighboring columns between them (R, 2 C - 1, 3): what a
    profile has between two columns is not to lie below the surface."""
    return np.insert(vectors, range(1, ACROSS), (vectors[:, :-1] + vectors[:, 1:]) / 2, axis=1)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
