# SPDX-License-Identifier: GPL-3.0-or-later
"""Proxies that are updated after each of many edits, against those that are made from nothing."""

import igl
import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.field.evaluate import values_and_gradients
from neural_sculpt_addon.field.levels import (
    SUPPORT,
    Level,
    cells_of,
    linear,
    places,
    quantised,
    support,
)
from neural_sculpt_addon.field.mesh.proxy import extract, update
from neural_sculpt_addon.field.mesh.refinement.refine import EDGE_TOLERANCE, again, refine
from tests.field.analytic import ball

MANY, EDITS = 10**7, 6


def bumps(seed, near, level=5, count=30, amount=0.1):
    """Bumps and pits, one upon the other, about a place of a sphere of radius 1/2."""
    random = np.random.default_rng(seed)
    spots = near + 0.12 * random.normal(size=(count, 3))
    spots *= 0.5 / np.linalg.norm(spots, axis=1, keepdims=True)
    index = np.unique(linear(cells_of(spots.astype(np.float32), level), level))
    return {level: Level(index, quantised(amount * random.choice([-1, 1], len(index))))}


def off_surface(field, mesh):
    """How far vertices are from f = 0, to first order."""
    value, gradient = values_and_gradients(field, mesh.vertices)
    return np.abs(value) / np.linalg.norm(gradient, axis=1)


def assert_sound(field, mesh, spacing):
    shape = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    _, uses = np.unique(shape.edges_sorted, axis=0, return_counts=True)
    assert (uses == 2).all() and shape.is_winding_consistent
    _, gradient = values_and_gradients(field, shape.triangles_center)
    assert ((shape.face_normals * gradient).sum(axis=1) >= 0).all()
    assert off_surface(field, mesh).max() < EDGE_TOLERANCE * spacing
    assert np.mean(np.degrees(shape.face_angles.min(axis=1)) < 5) < 1e-3


def distances(mesh, points):
    """Of points from the mesh."""
    corners, triangles = mesh.vertices.astype(float), mesh.triangles.astype(np.int64)
    return np.sqrt(igl.point_mesh_squared_distance(points, corners, triangles)[0])


@pytest.mark.parametrize(("seed", "cells"), [(seed, n) for seed in range(4) for n in (32, 40, 48)])
def test_after_each_edit_a_proxy_is_as_sound_as_one_made_from_nothing(seed, cells):
    field, near = ball(0.5), np.array([0.3, 0.3, 0.26])
    proxy = extract(field, cells)
    fine, spacing = refine(field, proxy, MANY), proxy.active.spacing
    for number in range(EDITS):
        change = bumps([seed, number], near)
        field, reached = field.plus(change), support(change)
        proxy = update(proxy, field, reached)
        fine = again(field, proxy, fine, reached, MANY)
        assert_sound(field, proxy, spacing)
        assert_sound(field, fine, spacing)
    anew = extract(field, cells)
    points = extract(field, 4 * cells).vertices.astype(float)
    for mesh, other in ((proxy, anew), (fine, refine(field, anew, MANY))):
        far = [np.quantile(distances(each, points), 0.99) for each in (mesh, other)]
        assert far[0] == pytest.approx(far[1], rel=0.1)


def test_a_vertex_that_was_moved_to_where_an_edit_comes_goes_with_the_surface():
    """As untangling may move one, but by hand and farther."""
    field = ball(0.5)
    proxy = extract(field, 48)
    marched, spacing = proxy.marched, proxy.active.spacing
    top = np.array([0, 0, 0.5])
    change = bumps(1, top, count=3)
    away = np.linalg.norm(marched.vertices - top, axis=1)
    moved = int(np.abs(away - 0.42).argmin())
    cells = places(support(change), SUPPORT)
    assert not (cells == cells_of(marched.vertices[moved, None], SUPPORT)).all(axis=1).any()
    # To the vertex that the edit moves the most.
    after = field.plus(change)
    target = int(off_surface(after, proxy).argmax())
    marched.vertices[moved], marched.normals[moved] = (
        marched.vertices[target],
        marched.normals[target],
    )
    assert off_surface(after, proxy)[target] > EDGE_TOLERANCE * spacing
    updated = update(proxy, after, support(change))
    same = np.searchsorted(updated.edges, proxy.edges[moved])
    assert updated.edges[same] == proxy.edges[moved]
    assert off_surface(after, updated).max() < EDGE_TOLERANCE * spacing
    far = np.flatnonzero(proxy.vertices[:, 2] < 0)
    kept = np.searchsorted(updated.edges, proxy.edges[far])
    np.testing.assert_array_equal(updated.vertices[kept], proxy.vertices[far])


def test_what_is_torn_off_is_told_by_the_lattice_and_not_by_where_vertices_were_moved():
    """A drop whose vertices were turned inside out is no bubble, and stays."""
    node = cells_of(np.float32([[0.6, 0.01, 0.01]]), 5) + np.indices((2, 2, 2)).reshape(3, -1).T
    drop = {5: Level(linear(node.astype(np.int32), 5), quantised(np.full(8, -0.3)))}
    field = ball(0.5).plus(drop)
    proxy = extract(field, 48)
    (first, second), marched = np.bincount(proxy.components.labels), proxy.marched
    assert min(first, second) < 50
    of_drop = proxy.components.labels == int(second < first)
    marched.vertices[of_drop] = (
        2 * marched.vertices[of_drop].mean(axis=0) - marched.vertices[of_drop]
    )
    change = bumps(1, np.array([0, 0, -0.5]), count=3)
    updated = update(proxy, field.plus(change), support(change))
    assert updated.components.total == 2
