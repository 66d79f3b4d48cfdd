# SPDX-License-Identifier: GPL-3.0-or-later
"""The ground truth of an edit: the dense mesh of the unedited field, its vertices displaced.

The paper's ground truth is a mesh, too. Edges under the stroke are halved twice first: triangles of
256 cells would be off by up to 0.4e-3 where a profile bends most, more than some methods are. What
is left, a sixteenth of that, is the least that distances from it can tell; distances of displaced
samples (`measures`) have no such bound. Model space.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.mesh.edges import find_edges
from neural_sculpt_addon.field.mesh.proxy import Proxy
from neural_sculpt_addon.field.mesh.refinement.subdivide import halved
from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.problem.problem import Problem
from neural_sculpt_addon.field.projection import project
from neural_sculpt_addon.field.threads import in_pieces, join

from .surface import MeshSurface

BESIDE = 1.1  # radii, within which edges are halved
DIVISIONS = 2
RASTER = 1 / 16  # radii, between the places that tell which parts hang together


def divided(problem: Problem, proxy: Proxy) -> tuple[Samples, np.ndarray]:
    """Vertices and triangles (F, 3) of the unedited surface, fine under the stroke."""
    samples, triangles = Samples(proxy.vertices, proxy.normals), proxy.triangles
    for _ in range(DIVISIONS):
        near = problem.copies.relative_distance(samples, beyond_flat_ends=False) < BESIDE
        ends, of_corners = find_edges(triangles)  # (E, 2), (F, 3)
        split = near[ends].any(axis=1)
        middles = project(problem.field, samples.points[ends[split]].mean(axis=1))
        triangles = halved(triangles, of_corners, split, samples.points, middles.points)
        samples = join([samples, Samples(middles.points, middles.normals)])
    return samples, triangles.astype(np.int64)


def displaced_mesh(problem: Problem, proxy: Proxy) -> MeshSurface:
    """The surface that the stroke asks for, of the dense proxy of the unedited field.

    Without what bounds nothing where the displaced surface runs through itself: triangles that lie
    within the new shape, or that the stroke swallows, and those of hollows, crumbs and films.
    """
    samples, triangles = divided(problem, proxy)
    moved, stretch = problem.displaced(samples)
    bounds = stretch > 0
    if not bounds.all():
        still = (moved.points == samples.points).all(axis=1)
        bounds[still] &= ~problem.folded.swept.swallows(samples.points[still])
        bounds[~still] &= _parts_meet(problem, moved.points[~still])
    return MeshSurface(moved.points.astype(float), triangles[bounds[triangles].any(axis=1)])


def _parts_meet(problem: Problem, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """At which of points (N, 3) of the displaced surface the solid of the shape and the space
    around it meet, as a raster tells.

    A hollow that nothing opens and a crumb that hangs on nothing are neither, nor is what is
    thinner than the raster: nobody asks for them.
    """
    step = RASTER * problem.stroke.brush.radius
    low = points.min(axis=0) - 2 * step
    shape = tuple(np.ceil((points.max(axis=0) + 2 * step - low) / step).astype(int) + 1)
    corners = (low + step * np.indices(shape).reshape(3, -1).T).astype(np.float32)
    f = in_pieces(lambda part: values(problem.field, corners[part]), len(corners))
    inside = problem.folded.inside(corners, f).reshape(shape)
    meet, parts = np.ones(len(points), bool), np.empty(shape, np.int32)
    first = np.floor((points - low) / step).astype(int)
    for side in (inside, ~inside):
        label(side, output=parts)
        faces = [np.take(parts, end, axis) for axis in range(3) for end in (0, -1)]
        whole = side & np.isin(parts, np.concatenate([face.ravel() for face in faces]))
        around = [whole[tuple((first + corner).T)] for corner in np.ndindex(2, 2, 2)]
        meet &= np.logical_or.reduce(around)
    return meet
