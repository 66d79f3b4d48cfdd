# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed pieces within each other: cavities stay, wrongly wound pieces are turned.

What is inside is worked out from closed forms of balls, and the number of walls around a point.
"""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.field.fit.fit import fit_mesh
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance


def ball(radius, facing=1, center=(0, 0, 0), fineness=3):
    """Vertices and faces of a sphere; its normals point outward, or inward with -1."""
    mesh = trimesh.creation.icosphere(fineness, radius)
    return mesh.vertices + center, mesh.faces[:, ::facing]


def joined(*meshes):
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def signs(vertices, faces, points):
    """Whether points of the mesh's space are inside of what is made of it."""
    mesh = clean(vertices, faces)
    return MeshDistance(mesh, np.random.default_rng(0))((points - mesh.center) / mesh.scale).value


def between(radii, count=3000):
    """Points of all directions whose radii are clear of those of the walls, and the radii."""
    rng = np.random.default_rng(2)
    r = rng.uniform(0, 1.1 * max(radii), count)
    r = r[(np.abs(r[:, None] - radii) > 0.02).all(axis=1)]
    n = rng.standard_normal((len(r), 3))
    return r[:, None] * n / np.linalg.norm(n, axis=1, keepdims=True), r


SHELLS = np.array([1.0, 0.7, 0.4])


@pytest.mark.parametrize("turned", [1, -1])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_ball_in_a_hollow_ball_stays_whichever_way_all_faces_look(turned, reverse):
    shells = [ball(r, turned * way) for r, way in zip(SHELLS, (1, -1, 1), strict=True)]
    points, r = between(SHELLS)
    value = signs(*joined(*(shells[::-1] if reverse else shells)), points)
    assert np.array_equal(value < 0, (r < 0.4) | ((r > 0.7) & (r < 1)))
    distance = np.abs(r[:, None] - SHELLS).min(axis=1)
    scale = 1.7 / 2
    assert np.abs(value) == pytest.approx(distance * scale, abs=0.01)


@pytest.mark.parametrize(
    ("ways", "solid"),
    [
        ((1, -1), [(0.7, 1)]),
        ((1, 1), [(0, 1)]),  # a ball within a ball bounds nothing
        ((1, -1, -1), [(0.7, 1), (0, 0.4)]),  # there is nothing to be hollowed out
        ((1, 1, -1), [(0, 1)]),  # the cavity of the inner ball is filled by the outer one
        ((-1, 1), [(0.7, 1)]),  # all inside out
        ((-1, -1), [(0, 1)]),
    ],
)
def test_nested_balls_are_solid_where_their_walls_say(ways, solid):
    points, r = between(SHELLS)
    mesh = joined(*(ball(r, way) for r, way in zip(SHELLS, ways, strict=False)))
    inside = np.any([(r > low) & (r < high) for low, high in solid], axis=0)
    assert np.array_equal(signs(*mesh, points) < 0, inside)


def test_only_the_wrongly_wound_piece_is_turned():
    hollow = joined(ball(1.0), ball(0.7, -1))
    assert clean(*hollow).repairs["flipped"] == 0
    beside = ball(0.3, -1, (2, 0, 0))
    assert clean(*joined(hollow, beside)).repairs["flipped"] == len(beside[1])


def test_a_cavity_may_lie_in_the_union_of_two_balls():
    mesh = joined(ball(1), ball(1, 1, (1, 0, 0)), ball(0.25, -1, (0.5, 0.75, 0)))
    centers = np.array([[0.5, 0.75, 0], [0.5, 0, 0], [0, 0.6, 0], [1, 0.6, 0], [0.5, 1.2, 0]])
    assert (signs(*mesh, centers) < 0).tolist() == [True, True, True, True, False]
    mesh = joined(ball(1), ball(1, 1, (1.5, 0, 0)), ball(0.3, -1, (0, 0.1, 0)))
    assert (signs(*mesh, np.array([[0, 0.1, 0], [0.75, 0, 0]])) < 0).tolist() == [False, True]


@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_random_nests_are_solid_where_an_odd_number_of_walls_is_around(data):
    """Nests of balls, wound alternately; any of them inside out as a whole."""
    rng = np.random.default_rng(data.draw(st.integers(0, 2**31)))
    shells, walls = [], []
    for nest in range(data.draw(st.integers(1, 3))):
        center = np.array([3.0 * nest, 0, 0])
        turned = data.draw(st.sampled_from([1, -1]))
        radius = 1.0
        for depth in range(data.draw(st.integers(1, 5))):
            shells.append(ball(radius, turned * (-1) ** depth, center, 2))
            walls.append((center, radius))
            center = center + 0.1 * radius * rng.uniform(-1, 1, 3)
            radius *= rng.uniform(0.6, 0.75)
    vertices, faces = joined(*(shells[i] for i in rng.permutation(len(shells))))
    turned = rng.random(len(faces)) < 0.2
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    points = vertices.min(axis=0) + rng.random((2000, 3)) * np.ptp(vertices, axis=0)
    gaps = np.stack([np.linalg.norm(points - c, axis=1) - r for c, r in walls])
    radii = np.array([r for _, r in walls])[:, None]
    clear = (np.abs(gaps) > 0.05 * radii).all(axis=0)  # of the flat faces between the vertices
    inside = (gaps < 0).sum(axis=0) % 2 == 1
    assert np.array_equal((signs(vertices, faces, points) < 0)[clear], inside[clear])


@pytest.mark.long
def test_the_field_of_a_hollow_ball_is_hollow():
    fit = fit_mesh(*joined(ball(1.0, fineness=4), ball(0.6, -1, fineness=4)), preset="draft")
    assert fit.report["flipped"] == 0
    assert fit.report["components"] == 2
    assert fit.report["sign_errors"] == 0
    assert fit.field.sample(np.zeros((1, 3), np.float32)).f[0] > 0.3
