# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles with halved edges: the same surface, without a crack, wound as before."""

import numpy as np
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from neural_sculpt_addon.field.mesh.edges import find_edges
from neural_sculpt_addon.field.mesh.refinement.subdivide import halved

BALL = trimesh.creation.icosphere(subdivisions=1, radius=0.5)


def ball(chosen):
    """The ball with the chosen of its edges halved, its middles not brought to the sphere."""
    triangles = np.asarray(BALL.faces, np.int32)
    ends, of_corners = find_edges(triangles)
    middles = BALL.vertices[ends[chosen]].mean(axis=1)
    parts = halved(triangles, of_corners, chosen, BALL.vertices, middles)
    vertices = np.concatenate([BALL.vertices, middles])
    return trimesh.Trimesh(vertices, parts, process=False), ends


@given(st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_any_edges_can_be_halved(seed, share):
    """Closed, of the same area and volume, and each halved edge costs one triangle on each side."""
    chosen = np.random.default_rng(seed).uniform(size=len(BALL.edges_unique)) < share
    mesh, _ = ball(chosen)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert len(mesh.faces) == len(BALL.faces) + 2 * np.count_nonzero(chosen)
    assert (mesh.area_faces > 0).all()
    np.testing.assert_allclose((mesh.area, mesh.volume), (BALL.area, BALL.volume), rtol=1e-9)


def test_all_edges_halved_are_four_triangles_for_one():
    mesh, ends = ball(np.ones(len(BALL.edges_unique), bool))
    vertices, faces = trimesh.remesh.subdivide(BALL.vertices, BALL.faces)
    assert len(mesh.faces) == len(faces) == 4 * len(BALL.faces)
    assert len(mesh.vertices) == len(vertices) == len(BALL.vertices) + len(ends)
    found, expected = (
        np.sort(np.asarray(m.triangles_center).round(9), axis=0)
        for m in (mesh, trimesh.Trimesh(vertices, faces, process=False))
    )
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_nothing_chosen_is_nothing_done():
    mesh, _ = ball(np.zeros(len(BALL.edges_unique), bool))
    assert np.array_equal(mesh.faces, BALL.faces)
