# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest points of smooth and of rough surfaces."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from neural_sculpt_addon.field.levels import Level, cells_per_axis, linear
from neural_sculpt_addon.field.mesh.nearest import Nearest
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.mesh.surface import Samples, SurfaceMesh
from neural_sculpt_addon.field.projection import project
from tests.field.analytic import ball

LINE = np.column_stack([np.linspace(-0.25, 0.25, 129), np.full(129, 0.05), np.full(129, 0.45)])


def mesh_of(field):
    proxy = extract(field, 128)
    return SurfaceMesh(Samples(proxy.vertices, proxy.normals), proxy.triangles)


def rough(seed, height=0.15, level=4):
    """A ball with random hills and pits that are several cells of a proxy wide."""
    count = cells_per_axis(level)
    cells = np.stack(np.meshgrid(*[np.arange(8, count - 8)] * 3, indexing="ij"), -1).reshape(-1, 3)
    units = np.random.default_rng(seed).normal(0, height / 2**-22, len(cells)).round()
    index = linear(cells.astype(np.int32), level)
    return ball(0.5).plus({level: Level(index, (units * 2**-22).astype(np.float32))})


def length(points):
    return np.linalg.norm(np.diff(points, axis=0), axis=1).sum()


def test_of_a_smooth_surface_they_are_those_of_newton_steps():
    field = ball(0.5)
    found = Nearest(field, mesh_of(field), LINE, 0.2).find(LINE)
    np.testing.assert_array_equal(found.points, project(field, LINE).points)


@pytest.mark.parametrize("seed", range(4))
def test_a_line_over_hills_is_no_zigzag(seed):
    """Newton steps make one of it, from the same line, so the surface is rough enough."""
    field = rough(seed)
    mesh = mesh_of(field)
    found = Nearest(field, mesh, LINE, 0.2).find(LINE)
    dense = extract(field, 256).vertices
    nearest = KDTree(dense).query(LINE)[0]
    way = np.linalg.norm(found.points - LINE, axis=1)
    cell = 2 / 128
    assert (way < 1.1 * nearest + cell).all()
    assert KDTree(dense).query(found.points)[0].max() < cell
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, atol=1e-5)
    assert length(found.points) < 0.8 * length(project(field, LINE).points)


def test_without_a_mesh_there_they_are_those_of_newton_steps():
    field, aside = rough(0), LINE + np.array([0, 0, 5])
    some = Nearest(field, mesh_of(field), aside, 0.2).find(LINE)
    np.testing.assert_array_equal(some.points, project(field, LINE).points)
