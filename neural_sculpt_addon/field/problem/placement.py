# SPDX-License-Identifier: GPL-3.0-or-later
"""Placing a stroke on the surface: the spline through its control points is brought to f = 0.

The result is spaced uniformly by arc length on the surface itself, so u means the same on a flat
and on a bumpy shape (paper, section 3). Model space. See docs/method.md, section 2.
"""

from typing import NamedTuple

import numpy as np

from ...common.errors import SculptError
from ...stroke.curve import Array, arc_length, fit_curve
from ...stroke.path import Path, make_path
from ...stroke.stroke import Stroke
from ..field import Field
from ..mesh.nearest import Nearest
from ..mesh.surface import SurfaceMesh

PATH_POINTS = 257  # of a path; more on one that is longer than 64 radii
PER_RADIUS = 4  # at least
MOST_PATH_POINTS = 2049  # on a longer one still they are farther apart
MOST_OFF = 0.2
"""How far a control point may lie from the surface, or one radius if that is more. A stroke can
have been drawn on others that are muted now, or that turned out flatter than was foreseen."""
OFF_SURFACE = 0.02  # what projection may leave
LARGEST_GAP, SPANNED = 12.0, 1.0
"""Between neighbours on the path, in mean spacings and in radii: a gap beyond both is refused. A
narrower one the brush spans, as from ridge to ridge."""


class PlacedStroke(NamedTuple):
    """One copy of a stroke and its path on the surface."""

    stroke: Stroke
    path: Path


def place_stroke(field: Field, stroke: Stroke, mesh: SurfaceMesh | None = None) -> Path:
    """The path of `stroke` on the zero set of `field`.

    mesh: triangles of this surface; without them Newton steps alone find it, as in the paper

    SculptError when a control point is no surface point, or when the surface between two of them
    cannot be followed.
    """
    radius = stroke.brush.radius
    nearest = Nearest(field, mesh, stroke.points, max(MOST_OFF, radius))
    _check_on_surface(nearest, stroke)
    curve = fit_curve(stroke.points, stroke.closed)
    if len(curve.knots) == 1:
        surface = nearest.find(curve.points)
        return make_path(surface.points, surface.normals, image=stroke.image)
    points, _ = curve.resample(PATH_POINTS)
    if (count := PER_RADIUS * arc_length(points)[-1] / radius) > PATH_POINTS:
        points, _ = curve.resample(min(int(count), MOST_PATH_POINTS))
    for _ in range(2):  # projected points bunch up where the surface is steep; space them again
        points = _uniform(nearest.find(points).points.astype(float))
    surface = nearest.find(points)
    gaps = np.linalg.norm(np.diff(surface.points, axis=0), axis=1)
    leaps = gaps.max() > max(LARGEST_GAP * gaps.mean(), SPANNED * radius)
    if leaps or surface.distance.max() > OFF_SURFACE:
        raise SculptError(
            "The stroke leaves the surface between two of its points. Draw it with more points, or"
            " keep to one side of the shape."
        )
    return make_path(surface.points, surface.normals, curve.closed, stroke.image)


def _check_on_surface(nearest: Nearest, stroke: Stroke) -> None:
    surface = nearest.find(stroke.points)
    away = float(np.linalg.norm(surface.points - stroke.points, axis=1).max())
    if away > max(MOST_OFF, stroke.brush.radius) or surface.distance.max() > OFF_SURFACE:
        raise SculptError(
            "The stroke lies {} off the surface. Draw it on the proxy of this field.", f"{away:.2f}"
        )


def _uniform(points: Array) -> Array:
    """The same polyline (N, 3), its points moved along it to equal spacing."""
    along = arc_length(points)
    even = np.linspace(0, along[-1], len(points))
    return np.stack([np.interp(even, along, axis) for axis in points.T], axis=1)
