# SPDX-License-Identifier: GPL-3.0-or-later
"""Absorbing a sculpted proxy: the change is taken in, the rest stays, a bad proxy is refused."""

import igl
import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.edit.absorb import absorb
from neural_sculpt_addon.field.edit.boolean import combine, mesh_solid
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import spacing
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.projection import find_surface

TOP = np.array([0, 0, 0.6])


def dented(vertices, normals, height):
    """A smooth bump or dent around the top of the sphere, 0.25 wide."""
    share = np.linalg.norm(vertices - TOP, axis=1) / 0.25
    return vertices + height * (np.clip(1 - share**2, 0, None) ** 2)[:, None] * normals


@pytest.fixture(scope="module")
def sphere():
    field = primitive("sphere")
    return field, extract(field, 64)


@pytest.mark.parametrize("height", [0.08, -0.08])
def test_a_bump_is_taken_in_and_the_rest_stays(sphere, height):
    field, proxy = sphere
    done = absorb(field, dented(proxy.vertices, proxy.normals, height), proxy.triangles)
    ball = trimesh.creation.icosphere(5, radius=0.6).vertices
    away = find_surface(done.field, dented(ball, ball / 0.6, height)).distance
    changed = np.linalg.norm(ball - TOP, axis=1) < 0.25
    assert away[changed].mean() < 3e-4
    assert np.percentile(away[changed], 95) < 1e-3
    still = np.linalg.norm(ball - TOP, axis=1) > 0.3
    before = find_surface(field, ball).distance
    assert np.abs(away[still] - before[still]).mean() < 1e-5
    assert done.report["components"] == 1
    assert done.report["error_mean"] < 3e-4


def test_no_bit_changes_beyond_the_layers_support(sphere):
    field, proxy = sphere
    done = absorb(field, dented(proxy.vertices, proxy.normals, 0.05), proxy.triangles)
    points = np.random.default_rng(0).uniform(-1, 1, (20_000, 3))
    changed = values(done.field, points) != values(field, points)
    reach = 0.25 + 5 * spacing(min(done.layer))
    assert np.linalg.norm(points[changed] - TOP, axis=1).max() < reach
    again = field.plus(done.layer)
    assert np.array_equal(values(again, points), values(done.field, points))
    assert np.array_equal(values(again.plus(done.layer, -1), points), values(field, points))


@pytest.mark.long
def test_a_grabbed_horn_leaves_no_crumbs_where_the_surface_was(sphere):
    field, proxy = sphere
    share = np.clip(1 - (np.linalg.norm(proxy.vertices - TOP, axis=1) / 0.25) ** 2, 0, None) ** 2
    moved = proxy.vertices + share[:, None] * np.array([0.15, 0.0, 0.1], np.float32)
    done = absorb(field, moved, proxy.triangles)
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (20_000, 3)) + TOP
    kind = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    vertices, faces = moved.astype(float), proxy.triangles.astype(np.int64)
    signed, *_ = igl.signed_distance(points, vertices, faces, kind)
    clear = np.abs(signed) > 4e-3
    assert np.array_equal((values(done.field, points) < 0)[clear], (signed < 0)[clear])
    assert done.report["components"] == 1


def test_a_coarse_proxy_does_not_wear_the_field_down():
    field = primitive("torus")
    proxy = extract(field, 32)  # its facets are off by 2e-3
    vertices = proxy.vertices.copy()
    vertices[np.argmax(vertices[:, 0])] *= 1.02
    done = absorb(field, vertices, proxy.triangles)
    points = extract(field, 64).vertices
    far = points[points[:, 0] < 0.4]
    assert find_surface(done.field, far).distance.mean() < 2e-5


def test_a_proxy_of_another_topology_is_absorbed_as_a_whole(sphere):
    field, _ = sphere
    ball = trimesh.creation.icosphere(4, radius=0.64)
    done = absorb(field, ball.vertices, ball.faces)
    dense = trimesh.creation.icosphere(5, radius=0.64).vertices
    assert find_surface(done.field, dense).distance.mean() < 5e-4  # a hundredth of its edges
    assert done.report["components"] == 1


def test_a_cube_of_twelve_triangles_is_absorbed_with_flat_faces(sphere):
    """Its edges are creases, not what stands for a curve."""
    field, _ = sphere
    cube = trimesh.convex.convex_hull(trimesh.creation.box((0.8, 0.8, 0.8)))
    done = absorb(field, cube.vertices, cube.faces)
    points, _ = trimesh.sample.sample_surface(cube, 2000, seed=1)
    away = find_surface(done.field, points).distance
    assert away.mean() < 1e-3
    assert np.percentile(away, 95) < 4e-3


def with_ball(operation, center, radius):
    ball = trimesh.creation.icosphere(4, radius)
    solid = mesh_solid(ball.vertices + np.array(center), ball.faces)
    return combine(primitive("sphere"), solid, operation).field


@pytest.mark.parametrize(
    ("operation", "center", "radius"),
    [
        ("union", (0, 0, 0.72), 0.1),  # some cells beside the sphere
        pytest.param("union", (0.62, 0.3, 0), 0.012, marks=pytest.mark.long),  # a crumb
        pytest.param("union", (0.7, 0.7, 0), 0.25, marks=pytest.mark.long),
        pytest.param("difference", (0.1, -0.1, 0.15), 0.12, marks=pytest.mark.long),  # a hollow
    ],
)
def test_a_piece_that_was_deleted_is_gone_and_the_rest_stays(operation, center, radius):
    field = with_ball(operation, center, radius)
    proxy = extract(field, 128)
    of_ball = np.linalg.norm(proxy.vertices - center, axis=1) < 1.1 * radius
    done = absorb(field, proxy.vertices, proxy.triangles[~of_ball[proxy.triangles].any(axis=1)])
    fine = extract(done.field, 256)
    assert (proxy.components.total, fine.components.total) == (2, 1)
    assert (done.report["components"], "notes" in done.report) == (1, False)
    assert find_surface(done.field, proxy.vertices[~of_ball]).distance.max() < 2e-4
    inside = values(done.field, np.array([center], np.float32))[0] < 0
    assert inside == (operation == "difference")


def test_a_piece_that_the_proxy_did_not_show_stays():
    """An island between the points of a coarse lattice: nobody has deleted it."""
    field = with_ball("union", (0.62, 0.3, 0), 0.012)
    proxy = extract(field, 64)
    assert (proxy.components.total, extract(field, 128).components.total) == (1, 2)
    vertices = dented(proxy.vertices, proxy.normals, 0.05)
    done = absorb(field, vertices, proxy.triangles, cells=64)
    assert extract(done.field, 128).components.total == 2


def test_a_piece_is_deleted_and_another_one_is_sculpted():
    field = with_ball("union", (0.62, 0.62, 0), 0.15)
    proxy = extract(field, 128)
    of_ball = np.linalg.norm(proxy.vertices - (0.62, 0.62, 0), axis=1) < 0.2
    vertices = dented(proxy.vertices, proxy.normals, 0.05)
    done = absorb(field, vertices, proxy.triangles[~of_ball[proxy.triangles].any(axis=1)])
    assert extract(done.field, 256).components.total == done.report["components"] == 1
    ball = trimesh.creation.icosphere(5, radius=0.6).vertices
    assert find_surface(done.field, dented(ball, ball / 0.6, 0.05)).distance.mean() < 1e-4


def test_what_cannot_be_absorbed_says_why(sphere):
    field, proxy = sphere
    with pytest.raises(SculptError, match="nothing to absorb"):
        absorb(field, proxy.vertices, proxy.triangles)
    with pytest.raises(SculptError, match="leaves the box"):
        absorb(field, 2 * proxy.vertices, proxy.triangles)
    with pytest.raises(SculptError, match="no faces"):
        absorb(field, proxy.vertices, proxy.triangles[:0])
    cap = proxy.triangles[proxy.vertices[proxy.triangles].mean(axis=1)[:, 2] > 0.45]  # a flat cap
    with pytest.raises(SculptError, match="sheet"):
        absorb(field, 1.01 * proxy.vertices, cap)
