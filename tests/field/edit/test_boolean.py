# SPDX-License-Identifier: GPL-3.0-or-later
"""Booleans against closed forms and winding numbers: surface, blend, pieces, locality, refusals."""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.edit.boolean import combine, field_solid, mesh_solid
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import spacing
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.projection import project
from tests.field.analytic import ball

RADIUS, OTHER = 0.5, 0.3
ISLAND = np.array([0.62, 0.62, 0.0])
CENTER = np.array([0.4, 0.1, 0.2])


def moved(scale, offset):
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = offset
    return matrix


@pytest.fixture(scope="module")
def solid():
    """A ball of radius OTHER around CENTER, as a field that is scaled and moved."""
    return field_solid(ball(RADIUS), moved(OTHER / RADIUS, CENTER))


def distances(points):
    """Signed distances of both balls."""
    return np.linalg.norm(points, axis=1) - RADIUS, np.linalg.norm(points - CENTER, axis=1) - OTHER


@pytest.mark.parametrize(
    ("operation", "sign_a", "sign_b", "choose"),
    [
        ("union", 1, 1, np.minimum),
        pytest.param("difference", 1, -1, np.maximum, marks=pytest.mark.long),
        pytest.param("intersection", 1, 1, np.maximum, marks=pytest.mark.long),
    ],
)
def test_the_result_is_that_of_the_two_balls(solid, operation, sign_a, sign_b, choose):
    done = combine(ball(RADIUS), solid, operation)
    proxy = extract(done.field, 96)
    a, b = distances(proxy.vertices)
    off = np.abs(choose(sign_a * a, sign_b * b))
    assert off.mean() < 1e-4
    assert off.max() < 4e-3  # where they meet, in a crease
    points = np.random.default_rng(0).uniform(-1, 1, (20_000, 3))
    a, b = distances(points)
    wanted = choose(sign_a * a, sign_b * b)
    clear = np.abs(wanted) > 0.01
    assert np.array_equal(values(done.field, points)[clear] < 0, wanted[clear] < 0)
    assert done.report["components"] == components(proxy) == 1


@pytest.mark.long
def test_a_blend_fills_a_corner_by_a_quarter_of_its_radius():
    """Two equal balls: halfway between them f = g, so that min - k / 4 lies there."""
    blend, apart = 0.2, np.array([0.5, 0, 0])
    field = ball(0.35)
    done = combine(field, field_solid(field, moved(1, apart)), "union", blend)
    ring = np.array([[0.25, 0.35 * np.cos(t), 0.35 * np.sin(t)] for t in np.linspace(0, 6, 40)])
    found = project(done.field, ring).points
    height = np.linalg.norm(found[:, 1:], axis=1)
    # sqrt(0.25^2 + y^2) - 0.35 = k / 4, but that f = (|x|^2 - R^2) / 2 R is no distance there
    wanted = np.sqrt(0.35**2 + 2 * 0.35 * blend / 4 - 0.25**2)
    np.testing.assert_allclose(height, wanted, atol=1e-3)


@pytest.mark.long
def test_a_mesh_cuts_and_beyond_the_layers_reach_no_bit_changes():
    field = ball(RADIUS)
    box = trimesh.creation.box((0.2, 0.2, 1.0))
    box.apply_translation((0.45, 0, 0))
    done = combine(field, mesh_solid(box.vertices, box.faces), "difference")
    wall = np.array([[0.35, y, z] for y in (-0.05, 0, 0.05) for z in (-0.2, 0, 0.2)])
    assert np.linalg.norm(project(done.field, wall).points - wall, axis=1).max() < 5e-4
    points = np.random.default_rng(0).uniform(-1, 1, (20_000, 3))
    changed = values(done.field, points) != values(field, points)
    low, high = box.bounds
    beyond = np.maximum(low - points, points - high).max(axis=1)
    assert changed.any() and beyond[changed].max() < 5 * spacing(min(done.layer))
    assert np.array_equal(values(done.field.plus(done.layer, -1), points), values(field, points))


@pytest.mark.long
def test_a_ball_cut_in_two_is_two_pieces():
    slab = trimesh.creation.box((0.1, 0.5, 0.5))
    done = combine(ball(0.2), mesh_solid(slab.vertices, slab.faces), "difference")
    assert components(extract(done.field, 128)) == 2


def icosphere(radius, center):
    mesh = trimesh.creation.icosphere(4, radius)
    return mesh_solid(mesh.vertices + np.array(center), mesh.faces)


@pytest.mark.long
def test_a_hollow_has_no_others_around_it():
    """The ball is so deep inside that only the largest cells reach that far."""
    center, radius = np.array([0, 0.1, 0]), 0.2
    done = combine(primitive("sphere"), icosphere(radius, center), "difference")
    fine = extract(done.field, 256)
    assert components(fine) == 2
    hollow = np.linalg.norm(fine.vertices - center, axis=1) < 0.25
    assert np.abs(np.linalg.norm(fine.vertices[hollow] - center, axis=1) - radius).max() < 1e-3


@pytest.fixture(scope="module")
def two():
    """A sphere of radius 0.6 and an island beside it."""
    return combine(primitive("sphere"), icosphere(0.15, ISLAND), "union").field


@pytest.mark.parametrize("dent", [False, True])
def test_an_island_can_be_taken_away(two, dent):
    """Its surface has no part in the result, which shows no vertex that was moved there."""
    eraser = trimesh.creation.icosphere(3, 0.2)
    eraser.apply_translation(ISLAND)
    if dent:
        small = trimesh.creation.icosphere(3, 0.05)
        small.apply_translation((0, 0, -0.62))
        eraser = trimesh.util.concatenate([eraser, small])
    done = combine(two, mesh_solid(eraser.vertices, eraser.faces), "difference")
    assert (components(extract(two, 128)), components(extract(done.field, 256))) == (2, 1)
    assert done.report["components"] == 1
    assert "notes" not in done.report


def test_what_cannot_be_is_refused(solid):
    field = ball(RADIUS)
    far = field_solid(field, moved(1, (0.8, 0, 0)))
    with pytest.raises(SculptError, match="leave the box"):
        combine(field, far, "union")
    with pytest.raises(SculptError, match="no surface"):
        combine(field, field_solid(field, moved(0.1, (0.9, 0.9, 0.9))), "intersection")
    with pytest.raises(SculptError, match="changes nothing"):
        combine(field, field_solid(field, moved(0.1, (0.9, 0.9, 0.9))), "difference")
    with pytest.raises(SculptError, match="choose one of"):
        combine(field, solid, "xor")
    with pytest.raises(SculptError, match="blend radius"):
        combine(field, solid, "union", -1.0)
    with pytest.raises(SculptError, match="scaled to nothing"):
        field_solid(field, moved(0, CENTER))
