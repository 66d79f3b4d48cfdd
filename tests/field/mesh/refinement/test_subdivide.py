# SPDX-License-Identifier: GPL-3.0-or-later
"""Subdivision of flat triangles: closed meshes stay closed, area and volume the same."""

from typing import NamedTuple

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.field.mesh.refinement.subdivide import (
    Subdivision,
    divide,
    divided,
    ends_of,
    names,
    open_edges,
)

MESHES = {
    "ball": trimesh.creation.icosphere(2),
    "torus": trimesh.creation.torus(1.0, 0.3, 16, 12),
    "box": trimesh.creation.box(),
}


@settings(max_examples=60, deadline=None)
@given(
    shape=st.sampled_from(sorted(MESHES)),
    share=st.floats(0.0, 1.0),
    seed=st.integers(0, 2**31),
    times=st.integers(1, 3),
)
def test_any_marked_edges_leave_a_mesh_closed_and_its_volume_the_same(shape, share, seed, times):
    mesh, random = MESHES[shape], np.random.default_rng(seed)
    count = len(mesh.faces)
    vertices = mesh.vertices.astype(np.float32)
    parts, done = (
        Subdivision.whole(mesh.faces.astype(np.int32), np.arange(count, dtype=np.int32)),
        [],
    )
    for _ in range(times):
        edges = open_edges(parts)
        assert not edges.alone.any()
        marked = random.random(len(edges.ends)) < share
        number = np.where(marked, len(vertices) + np.cumsum(marked) - 1, -1).astype(np.int32)
        vertices = np.concatenate([vertices, vertices[edges.ends[marked]].mean(axis=1)])
        middles = np.append(number, np.int32(-1)).take(edges.corners)
        some = (middles >= 0).any(axis=1)
        done.append(parts.where(~some))
        parts = divided(parts.where(some), middles[some], vertices)
    parts = Subdivision.together([*done, parts])
    found = trimesh.Trimesh(vertices, parts.triangles, process=False)
    assert found.is_watertight and found.is_winding_consistent
    assert found.euler_number == mesh.euler_number
    assert found.volume == pytest.approx(mesh.volume, rel=1e-5)
    areas = np.bincount(parts.parents, found.area_faces, minlength=count)
    np.testing.assert_allclose(areas, mesh.area_faces, rtol=1e-4)


def test_a_settled_edge_is_not_asked_about_again():
    parts = Subdivision.whole(np.array([[0, 1, 2]], np.int32), np.array([7], np.int32))
    edges = open_edges(parts)
    first = {frozenset(pair): k for k, pair in enumerate(edges.ends.tolist())}
    number = np.full(3, -1, np.int32)
    number[first[frozenset((0, 1))]] = 3
    vertices = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0, 0]], np.float32)
    parts = divided(parts, number.take(edges.corners), vertices)
    assert parts.parents.tolist() == [7, 7]
    asked = {frozenset(pair) for pair in open_edges(parts).ends.tolist()}
    assert asked == {frozenset(pair) for pair in ((0, 3), (3, 1), (2, 3))}


def test_names_of_edges_tell_their_ends_in_either_order():
    ends = np.array([[3, 1], [1, 3], [2**30, 5]], np.int32)
    assert names(ends)[0] == names(ends)[1]
    assert ends_of(names(ends)).tolist() == [[1, 3], [1, 3], [5, 2**30]]


class Places(NamedTuple):
    points: np.ndarray


@pytest.mark.parametrize(
    ("most", "added"), [(4, []), (5, [(1, 0.5)]), (7, [(1, 0.5), (1, 0), (1, 1)])]
)
def test_the_longest_edges_are_halved_first(most, added):
    """Of a strip of 2 x 1 the diagonal, then its sides of 2; those of 1 are short enough."""
    corners = np.float32([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    triangles = np.int32([[0, 1, 2], [0, 2, 3]])

    def excess(one, other):
        length = np.linalg.norm(one.points - other.points, axis=1)
        return np.where(length > 1.05, length, 0)

    def middles(one, other):
        return Places((one.points + other.points) / 2)

    found, (points,) = divide(triangles, Places(corners), excess, middles, most)
    assert {tuple(point) for point in points[4:, :2].tolist()} == set(added)
    assert trimesh.Trimesh(points, found, process=False).area == pytest.approx(2)
