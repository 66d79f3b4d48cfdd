# SPDX-License-Identifier: GPL-3.0-or-later
"""Goals of strokes that reshape what is there: smooth, flatten, pinch (docs/method.md, section 6).

smooth   x' minimises |x' - x|^2 + s^4 |curvature of x'|^2: the biharmonic fairing of Desbrun et al.
         1999. What is shorter than some 6 s goes, what is longer stays, and round shapes do not
         shrink, as they do when each vertex moves to the mean of its neighbours
flatten  the plane of least squares through the surface around each place of the path
pinch    the place of the path that is nearest, along the surface

A vertex goes a share of the way: profile, modulation and strength, as of `displacement`. Model
space.
"""

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import KDTree

from ...stroke.curve import Array
from ...stroke.path import Path, locate
from ...stroke.stroke import Kind
from ..mesh.surface import Samples

SMOOTHED = 0.25
"""s in radii: what is shorter than 1.5 radii goes, three quarters of the stroke's width."""

SPREAD = 0.5
"""Radii, the standard deviation of the weights around a place of the path, and between places."""

PINCHED = 0.5
"""Share of the way to the path at full strength. From 1 on the surface would fold."""


def goals(
    kind: Kind, path: Path, radius: float, surface: Samples, triangles: NDArray[np.int64]
) -> Array:
    """Where the vertices (N, 3) of a patch would go in full; `radius` of the stroke."""
    points = surface.points.astype(float)
    if kind is Kind.SMOOTH:
        return faired(points, triangles, SMOOTHED * radius)
    if kind is Kind.FLATTEN:
        return _flattened(points, path, radius)
    return points + PINCHED * _to_path(path, surface)


def faired(points: Array, triangles: NDArray[np.int64], scale: float) -> Array:
    """Vertices (N, 3) without what is shorter than some 6 times the scale; at the patch's border,
    where curvature is not known, none is asked for."""
    laplacian = csc_array(igl.cotmatrix(points, triangles))
    mass = np.asarray(igl.massmatrix(points, triangles).diagonal())
    mass = np.maximum(mass, 1e-3 * mass.mean())  # of slivers
    inner = np.ones(len(points))
    inner[np.unique(igl.boundary_facets(triangles)[0])] = 0
    curvature = diags_array(inner) @ laplacian
    system = diags_array(mass) + scale**4 * curvature.T @ diags_array(1 / mass) @ curvature
    factors = splu(csc_array(system), "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
    return factors.solve(mass[:, None] * points)


def _flattened(points: Array, path: Path, radius: float) -> Array:
    """The points (N, 3) on planes through the surface around places of the path.

    Each point goes to the mean of the places' planes, weighted by how near they are.
    """
    count = max(int(np.ceil(path.length / (SPREAD * radius))), 1) + 1
    places = np.linspace(0, len(path.points) - 1, count).round().astype(int)
    near = KDTree(points)
    total, weights = np.zeros_like(points), np.zeros(len(points))
    for place in np.unique(places):
        some = np.array(near.query_ball_point(path.points[place], 2 * radius), int)
        away = points[some] - path.points[place]
        weight = np.exp(-(away**2).sum(axis=1) / (2 * (SPREAD * radius) ** 2))
        middle = weight @ points[some] / weight.sum()
        spread = (weight[:, None] * (points[some] - middle)).T @ (points[some] - middle)
        normal = np.linalg.eigh(spread)[1][:, 0]
        flat = points[some] - ((points[some] - middle) @ normal)[:, None] * normal
        total[some] += weight[:, None] * flat
        weights[some] += weight
    reached = weights > 0
    return np.where(reached[:, None], total / np.maximum(weights, 1e-300)[:, None], points)


def _to_path(path: Path, surface: Samples) -> Array:
    """The ways (N, 3) to the nearest points of the path, along the surface."""
    u = locate(path, surface.points).u
    nearest = path.points
    if len(path.points) > 1:
        nearest = np.stack([np.interp(u, path.u, axis) for axis in path.points.T], axis=1)
    way = nearest - surface.points
    return way - (way * surface.normals).sum(axis=1, keepdims=True) * surface.normals
