# SPDX-License-Identifier: GPL-3.0-or-later
"""What the overlay draws, as arrays: the tube as a ribbon, the brush circle, its cross-section.

All is laid on the surface by a function that the caller gives, `Lay`: points (N, 3) to the nearest
surface points and normals. The ribbon shows the displacement itself, d = m(u) s b(v / r) along the
normal, and never dives below the surface. NumPy alone; model space.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..stroke.brush import Brush
from ..stroke.curve import Array, fit_curve
from ..stroke.displacement import displace, local_radius
from ..stroke.path import make_path
from ..stroke.stroke import Kind, Stroke

ALONG, ACROSS = 40, 7  # points of the ribbon along and across the stroke
RIM = 32  # points of the circle
SECTION = 25  # points of the cross-section
LIFT = 0.004  # model units that keep what is drawn on a surface clear of the facets of a mesh

Lay = Callable[[ArrayLike], tuple[Array, Array]]


class Ribbon(NamedTuple):
    """The tube of one stroke, or of one of its images."""

    points: Array  # (ALONG, C, 3), C is ACROSS or more
    height: Array  # (ALONG, C), signed displacement, or share of the way
    strength: Array  # (ALONG,), in [0, 1]: the modulation, 1 where it is strongest


def ribbons(stroke: Stroke, lay: Lay) -> tuple[Ribbon, ...]:
    """The ribbon of the stroke and those of its images; none for a dab."""
    curve = fit_curve(stroke.points, stroke.closed)
    if len(curve.points) < 2:
        return ()
    path = make_path(*lay(curve.resample(ALONG)[0]), closed=curve.closed)
    across = local_radius(stroke, path.u)[:, None] * np.linspace(-1, 1, ACROSS)  # (R, C)
    flat = path.points[:, None] + across[..., None] * path.laterals[:, None]  # (R, C, 3)
    laid, normals = lay(flat.reshape(-1, 3))
    plain = replace(stroke, brush=replace(stroke.brush, alpha=None))  # finer than a ribbon
    height = displace(plain, path, laid, normals).amount.reshape(ALONG, ACROSS)
    displaced = np.maximum(height, 0) if stroke.kind is Kind.DRAW else np.zeros_like(height)
    raised = displaced[..., None] + LIFT
    points = laid.reshape(flat.shape) + raised * _smooth(normals.reshape(flat.shape))
    strength = np.abs(stroke.brush.modulation(path.u))
    strength = strength / max(strength.max(), 1.0)
    return tuple(Ribbon(points @ image.T, height, strength) for image in stroke.images)


def _smooth(normals: Array) -> Array:
    """Mean of normals (ALONG, ACROSS, 3) along the stroke, for those of facets jump."""
    padded = np.pad(normals, ((3, 3), (0, 0), (0, 0)), mode="edge")
    mean = np.mean([padded[i : i + ALONG] for i in range(7)], axis=0)
    return mean / np.maximum(np.linalg.norm(mean, axis=-1, keepdims=True), 1e-12)


@lru_cache
def ribbon_triangles(columns: int = ACROSS) -> NDArray[np.int32]:
    """Corners (T, 3) of a ribbon's triangles, as indices of its points."""
    corner = np.arange(ALONG * columns, dtype=np.int32).reshape(ALONG, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


class Cursor(NamedTuple):
    """The brush on the surface under the mouse."""

    rim: Array  # (RIM + 1, 3), closed
    base: Array  # (SECTION, 3), the surface across the circle
    section: Array  # (SECTION, 3), where the brush would move it


def cursor(brush: Brush, center: ArrayLike, normal: ArrayLike, axes: Array, lay: Lay) -> Cursor:
    """The circle around `center` (3,), and the profile across it for a stroke up the screen.

    axes: (3, 3), unit vectors to the right, up, and towards the viewer

    Where the surface faces the viewer, the height of the profile is drawn upwards instead of along
    the normal, so that it can be seen.
    """
    right, up, back = axes
    center, normal = np.asarray(center, float), np.asarray(normal, float)
    seen = normal - back * (normal @ back)
    aside = seen + up * (1 - np.linalg.norm(seen))
    right = right - normal * (right @ normal)
    right /= max(np.linalg.norm(right), 1e-12)
    angle = np.linspace(0, 2 * np.pi, RIM, endpoint=False)[:, None]
    around = np.cos(angle) * right + np.sin(angle) * np.cross(normal, right)  # (RIM, 3)
    v = np.linspace(-1, 1, SECTION)
    flat = np.vstack([around, v[:, None] * right]) * brush.radius + center
    laid, normals = lay(flat)
    laid = laid + LIFT * normals
    base = laid[RIM:]
    section = base + (brush.intensity * brush.profile(-v))[:, None] * aside
    return Cursor(np.vstack([laid[:RIM], laid[:1]]), base, section)
