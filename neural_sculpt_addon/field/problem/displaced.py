# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a stroke displaces samples of the surface to, and the normals of the displaced surface.

Where copies of a stroke overlap, the larger displacement wins. Model space. See docs/method.md,
section 2.
"""

import numpy as np

from ...stroke.curve import Array
from ...stroke.displacement import Displacement, displace
from ...stroke.path import Path
from ...stroke.stroke import Direction, Stroke
from ..evaluate import normals
from ..field import Field
from ..mesh.surface import Samples
from ..threads import in_pieces
from .copies import Copies, close

STEP = 1 / 1024
"""Radii, between two displacements whose difference tells the slope: larger ones round off the
bends of a profile, smaller ones drown in single precision."""

BEND = 5e-4
"""Model units, between two normals whose difference tells the curvature: larger ones blur detail,
smaller ones drown in single precision."""


def move(copies: Copies, surface: Samples) -> tuple[Samples, Array]:
    """Where surface samples (N,) that have the normals of the field shall be, without a look at
    where the displaced surface runs through itself, and by what factor (N,) their area is
    stretched."""

    def part_of(part: slice) -> tuple[Samples, Array]:
        return _move(copies, surface.where(part))

    return in_pieces(part_of, len(surface.points), copies.check)


def _move(copies: Copies, surface: Samples) -> tuple[Samples, Array]:
    points, guide = surface.points, copies.guide
    upright = surface.normals if guide is copies.field else normals(guide, points)
    moved = Samples(*(array.copy() for array in surface))
    largest, stretch = np.zeros((2, len(points)))
    stretch += 1
    for one in copies.laid:
        some = np.flatnonzero(close(one, points))
        there = displace(*one, points[some], upright[some])
        wins = np.abs(there.amount) > largest[some]
        won = some[wins]
        goal, factor = displaced(guide, *one, surface.where(won), there.where(wins))
        moved.points[won], moved.normals[won], stretch[won] = *goal, factor
        largest[won] = np.abs(there.amount[wins])
    return moved, stretch


def displaced(
    guide: Field, stroke: Stroke, path: Path, samples: Samples, displacement: Displacement
) -> tuple[Samples, Array]:
    """Where a stroke moves surface samples (N,), with the normals of the moved surface there, and
    by what factor (N,) it stretches the surface's area.

    The moved surface p + d w has the tangents t + (dd/dt) w + d dw/dt for tangents t of the
    surface. Their derivatives are one-sided differences, so this holds for every profile and end
    alike; `samples` have the normals of the surface, and `displacement` is by those of `guide`.
    """
    moved = samples.points + displacement.amount[:, None] * displacement.direction
    step = STEP * stroke.brush.radius
    first = np.cross(samples.normals, np.eye(3)[np.argmin(np.abs(samples.normals), axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(samples.normals, first)
    axes, twice = np.concatenate([first, second]), np.tile(np.arange(len(first)), 2)
    upright, both = displacement.normals[twice], displacement.where(twice)
    places = samples.points[twice]
    bend = (normals(guide, places + BEND * axes) - upright) / BEND
    ahead = displace(stroke, path, places + step * axes, upright + step * bend, both.vertex)
    slope = (ahead.amount - both.amount) / step
    if stroke.direction is Direction.STROKE:
        bend = (ahead.direction - both.direction) / step
    tangents = axes + slope[:, None] * both.direction + both.amount[:, None] * bend
    one, other = np.split(tangents, 2)
    turned = np.cross(one, other)
    stretch = np.linalg.norm(turned, axis=1)
    turned /= np.maximum(stretch, 1e-12)[:, None]
    return Samples(moved.astype(np.float32), turned.astype(np.float32)), stretch
