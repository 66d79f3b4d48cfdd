# SPDX-License-Identifier: GPL-3.0-or-later
"""Untangling against signed areas in a plane and the closed forms of thin plates."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.common.errors import Cancelled
from neural_sculpt_addon.common.progress import silent
from neural_sculpt_addon.field.evaluate import values_and_gradients
from neural_sculpt_addon.field.levels import Level, cells_of, linear, quantised, support
from neural_sculpt_addon.field.mesh.extraction.march import RawMesh
from neural_sculpt_addon.field.mesh.extraction.untangle import untangle
from neural_sculpt_addon.field.mesh.proxy import extract, update
from neural_sculpt_addon.field.mesh.refinement.refine import refine
from tests.field.analytic import ball, ellipsoid, plane

SIDE, SPACING = 8, 0.1


def grid():
    """A mesh of the plane z = 0: (SIDE + 1)^2 vertices, all squares cut along the same diagonal."""
    place = np.arange(SIDE + 1) * SPACING - 0.4
    vertices = np.stack(np.meshgrid(place, place, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(vertices), dtype=np.int32).reshape(SIDE + 1, SIDE + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.stack([np.stack(t, axis=-1) for t in ((a, b, c), (a, c, d))]).reshape(-1, 3)
    count = len(vertices)
    return RawMesh(
        vertices.astype(np.float32),
        np.tile(np.float32([0, 0, 1]), (count, 1)),
        triangles,
        np.arange(count),
        np.zeros((count, 3), bool),
        np.zeros(count, bool),
    )


def areas(mesh):
    """Signed areas seen from above, by the shoelace formula, in squares of the spacing."""
    (ax, ay), (bx, by), (cx, cy) = (mesh.vertices[t, :2].astype(float).T for t in mesh.triangles.T)
    return (ax * (by - cy) + bx * (cy - ay) + cx * (ay - by)) / 2 / SPACING**2


def smallest_angles(mesh):
    shape = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    return np.degrees(shape.face_angles.min(axis=1))


JUMPING = np.array([(i, j) for i in (2, 5) for j in (2, 5)]) @ [SIDE + 1, 1]


def tangled(seed, reach):
    """The grid, some of whose vertices were moved by so many spacings in random directions."""
    mesh, turn = grid(), np.random.default_rng(seed).uniform(0, 2 * np.pi, len(JUMPING))
    jump = reach * SPACING * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    mesh.vertices[JUMPING] += jump.astype(np.float32)
    return mesh


def untangled(mesh, fresh=None):
    fresh = np.ones(len(mesh.vertices), bool) if fresh is None else fresh
    untangle(mesh, fresh, plane(), SPACING, silent)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), reach=st.floats(0.8, 1.6))
def test_vertices_that_jumped_over_their_neighbours_come_back(seed, reach):
    mesh = tangled(seed, reach)
    start, triangles, over = mesh.vertices.copy(), mesh.triangles.copy(), areas(mesh) < 0
    thinnest = smallest_angles(mesh).min()
    untangled(mesh)
    assert (areas(mesh) >= 0).all()
    assert areas(mesh).sum() == pytest.approx(SIDE**2, rel=1e-5)  # it covers what it covered
    assert smallest_angles(mesh).min() > min(5, thinnest) - 1e-3
    assert np.abs(mesh.vertices[:, 2]).max() < 1e-6
    np.testing.assert_array_equal(mesh.triangles, triangles)
    moved = (mesh.vertices != start).any(axis=1)
    assert moved.any() == over.any()
    assert moved.sum() <= 3 * over.sum()


def test_where_nothing_is_turned_over_every_bit_stays():
    mesh = tangled(1, 0.3)
    start = mesh.vertices.copy()
    assert (areas(mesh) > 0).all()
    untangled(mesh)
    np.testing.assert_array_equal(mesh.vertices, start)


def test_vertices_that_are_held_or_not_fresh_stay():
    mesh = tangled(2, 1.2)
    assert (areas(mesh) < 0).any()
    start = mesh.vertices.copy()
    untangled(mesh, np.zeros(len(start), bool))
    np.testing.assert_array_equal(mesh.vertices, start)
    mesh.held[:, 0] = True
    untangled(mesh)
    np.testing.assert_array_equal(mesh.vertices, start)
    mesh.held[:] = False
    only = np.isin(np.arange(len(start)), JUMPING)
    untangled(mesh, only)
    np.testing.assert_array_equal(mesh.vertices[~only], start[~only])
    assert (areas(mesh) >= 0).all()


def test_it_can_be_cancelled():
    def cancel(fraction, message):
        raise Cancelled

    mesh = tangled(2, 1.2)
    with pytest.raises(Cancelled):
        untangle(mesh, np.ones(len(mesh.vertices), bool), plane(), SPACING, cancel)


def test_on_a_ball_vertices_stay_on_it_and_have_its_normals():
    proxy, random = extract(ball(), 32), np.random.default_rng(4)
    mesh, spacing = proxy.marched, proxy.active.spacing
    start = mesh.vertices.copy()
    jumping = random.choice(len(start), 60, replace=False)
    way = random.normal(size=(60, 3))
    way *= 1.5 * spacing / np.linalg.norm(way, axis=1, keepdims=True)
    jumped = mesh.vertices[jumping] + way
    mesh.normals[jumping] = jumped / np.linalg.norm(jumped, axis=1, keepdims=True)
    mesh.vertices[jumping] = 0.5 * mesh.normals[jumping]
    round_ = np.full(3, 0.5)
    assert (outward(mesh, round_) < 0).sum() > 60
    untangle(mesh, np.ones(len(start), bool), ball(), spacing, silent)
    assert (outward(mesh, round_) > 0).all()
    size = np.linalg.norm(mesh.vertices, axis=1)
    np.testing.assert_allclose(size, 0.5, atol=1e-5)
    moved = (mesh.vertices != start).any(axis=1)
    wanted = mesh.vertices[moved] / size[moved, None]
    assert (wanted * mesh.normals[moved]).sum(axis=1).min() > 0.999


def outward(mesh, axes):
    """Twice the areas of triangles times their cosines with the ellipsoid's normals."""
    a, b, c = mesh.vertices[mesh.triangles].astype(float).swapaxes(0, 1)
    return (np.cross(b - a, c - a) * ((a + b + c) / 3 / axes**2)).sum(axis=1)


@settings(max_examples=15, deadline=None)
@given(
    wide=st.tuples(st.floats(0.4, 0.8), st.floats(0.3, 0.7)),
    thin=st.floats(0.008, 0.05),
    axis=st.integers(0, 2),
    half=st.integers(8, 20),  # of an odd number of cells none may see it
)
def test_plates_thinner_than_a_cell_have_no_triangle_turned_over(wide, thin, axis, half):
    axes = np.insert(np.array(wide), axis, thin)
    field = ellipsoid(axes)
    proxy = extract(field, 2 * half)
    for mesh in (proxy, refine(field, proxy, 10**7)):
        assert (outward(mesh, axes) > 0).all()
        whole = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
        assert whole.is_watertight and whole.is_winding_consistent


def bumps(axes, seed, level=5):
    """Bumps about random places of the upper side of an ellipsoid."""
    random = np.random.default_rng(seed)
    place = np.append(random.uniform(-0.3, 0.3, 2), axes[2])
    cell = linear(cells_of(place[None].astype(np.float32), level), level)
    return {level: Level(cell, quantised(np.full(1, 0.02 * random.choice([-1, 1]))))}


def turned(field, mesh):
    shape = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    _, gradient = values_and_gradients(field, shape.triangles_center)
    return int(((shape.face_normals * gradient).sum(axis=1) < 0).sum())


def test_after_each_edit_no_triangle_is_turned_over():
    axes = np.array([0.7, 0.5, 0.015])
    field = ellipsoid(axes)
    proxy = extract(field, 32)
    for seed in range(6):
        change = bumps(axes, seed)
        field = field.plus(change)
        before, proxy = proxy, update(proxy, field, support(change))
        assert not np.array_equal(before.vertices, proxy.vertices)
        assert turned(field, proxy) == 0


def test_any_number_of_cores_gives_the_same_bits(cores):
    field = ellipsoid((0.7, 0.5, 0.015))
    found = []
    for number in (1, 3):
        cores(number)
        found.append(extract(field, 40))
    np.testing.assert_array_equal(found[0].vertices, found[1].vertices)
    np.testing.assert_array_equal(found[0].normals, found[1].normals)
