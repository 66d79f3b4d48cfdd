# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes whose parts touch, lie upon each other, or meet in seams.

What is inside is worked out from the boxes and balls that they are made of.
"""

import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance
from neural_sculpt_addon.field.fit.mesh_open import Open, prepare
from neural_sculpt_addon.field.geometry import areas

QUADS = np.array(  # of a cube whose corners are numbered x + 2 y + 4 z, seen from outside
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
)
NO, YES = np.zeros(6, bool), np.ones(6, bool)
CORNERS = np.stack([np.arange(8) % 2, np.arange(8) // 2 % 2, np.arange(8) // 4], axis=1)


def cube(low, high, diagonals, facing=1):
    """Vertices and faces of a box; each of its six sides is divided along either diagonal."""
    turned = np.where(np.asarray(diagonals)[:, None], np.roll(QUADS, 1, axis=1), QUADS)
    faces = turned[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return low + CORNERS * np.subtract(high, low), faces[:, ::facing]


def joined(*meshes):
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([v for v, _ in meshes]).astype(float), np.concatenate(faces)


def inside(mesh, points):
    """Whether points of the mesh's space are inside of what is made of it."""
    cleaned = clean(*mesh)
    distance = MeshDistance(cleaned, np.random.default_rng(0))
    return distance((points - cleaned.center) / cleaned.scale).value < 0


def border(mesh):
    return len(np.asarray(igl.boundary_facets(mesh.triangles)[0]))


def merged(mesh):
    """With one vertex in each place."""
    vertices, names = np.unique(mesh[0], axis=0, return_inverse=True)
    return vertices, names.reshape(-1)[mesh[1]]


def soup(mesh):
    """With vertices of its own for each face."""
    return mesh[0][mesh[1]].reshape(-1, 3), np.arange(mesh[1].size).reshape(-1, 3)


def blocks(rng, turned):
    """Cubes on a grid, some left out, a share of them `turned` inside out; and points, clear of
    their sides, with whether they are in one of the cubes."""
    there = rng.random(rng.integers(1, 4, 3)) < 0.8
    there.flat[0] = True
    meshes = [
        cube(cell, cell + 1, rng.random(6) < 0.5, rng.choice([1, -1], p=[1 - turned, turned]))
        for cell in np.argwhere(there)
    ]
    points = rng.uniform(-0.5, np.add(there.shape, 0.5), (3000, 3))
    points = points[(np.abs(points - np.rint(points)) > 0.03).all(axis=1)]
    cells = np.floor(points).astype(int)
    within = ((cells >= 0) & (cells < there.shape)).all(axis=1)
    within[within] = there[tuple(cells[within].T)]
    return joined(*meshes), points, within


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_touching_cubes_are_solid_however_their_sides_are_divided_and_turned(seed):
    mesh, points, within = blocks(np.random.default_rng(seed), 0.2)
    assert np.array_equal(inside(mesh, points), within)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**31), known=st.sampled_from([merged, soup]))
def test_touching_cubes_are_solid_when_nothing_tells_which_faces_are_of_one(seed, known):
    """Some share their walls, and others have them divided along the other diagonal."""
    mesh, points, within = blocks(np.random.default_rng(seed), 0)
    assert np.array_equal(inside(known(mesh), points), within)


@pytest.mark.parametrize("known", [merged, soup])
@pytest.mark.parametrize("turned", range(4))
@pytest.mark.parametrize("seed", range(6))
def test_the_sides_of_a_turned_cube_follow_those_of_the_others(known, turned, seed):
    """Four touching cubes in a square: the sides between them enclose nothing by themselves."""
    rng = np.random.default_rng(seed)
    cells = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    cubes = [
        cube(cell, cell + 1, rng.random(6) < 0.5, -1 if number == turned else 1)
        for number, cell in enumerate(cells)
    ]
    points = rng.uniform([-0.5, -0.5, -0.5], [2.5, 2.5, 1.5], (2000, 3))
    within = ((points > 0) & (points < [2, 2, 1])).all(axis=1)
    assert np.array_equal(inside(known(joined(*cubes)), points), within)


def test_a_card_with_two_sides_stays_a_sheet():
    """A leaf on a stem that has it twice, back to back, on the same vertices."""
    stem = cube([0, 0, 0], [0.2, 0.2, 2], NO)
    leaf = np.array([[0.2, 0, 0], [0.2, 0.2, 2], [1, 0.2, 2], [1, 0, 0]])
    front = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = clean(*merged(joined(stem, (leaf, np.concatenate([front, front[:, ::-1]])))))
    assert mesh.repairs["doubled"] == 2
    assert len(mesh.triangles) == 14


AROUND = cube([0, 0, 0], [2, 2, 2], NO)
CUBE = (np.zeros(3), np.full(3, 2.0))
ROOM = (np.full(3, 0.5), np.full(3, 1.5))
CLOSETS = [  # cavities that touch the wall, an edge, a corner of what they are in
    ([0.5, 0.5, 0], [1.5, 1.5, 1]),
    ([0.5, 0, 0], [1.5, 1, 1]),
    ([0, 0, 0], [1, 1, 1]),
    ([0, 0, 0], [2, 1, 1]),
]


@pytest.mark.parametrize("turned", [1, -1])
@pytest.mark.parametrize("diagonals", [NO, YES, np.arange(6) < 3])
def test_a_copy_upon_a_solid_counts_once_whichever_way_it_faces(turned, diagonals):
    mesh = joined(AROUND, cube(*CUBE, diagonals, turned))
    points = np.random.default_rng(1).uniform(-0.5, 2.5, (1000, 3))
    assert np.array_equal(inside(mesh, points), ((points > 0) & (points < 2)).all(axis=1))


@pytest.mark.parametrize("room", [ROOM, *CLOSETS])
@pytest.mark.parametrize("copies", [1, 2])
def test_cavities_stay_where_they_touch_the_wall_and_where_their_own_is_doubled(room, copies):
    rooms = [cube(*room, divided, -1) for divided in (NO, YES)[:copies]]
    points = np.random.default_rng(1).uniform(-0.5, 2.5, (3000, 3))
    solid = ((points > 0) & (points < 2)).all(axis=1)
    hollow = ((points > room[0]) & (points < room[1])).all(axis=1)
    assert np.array_equal(inside(joined(AROUND, *rooms), points), solid & ~hollow)


def gridded(low, high, facing=1):
    """A box (in whole units) whose sides are divided into unit squares."""
    high, cells = np.asarray(high), np.argwhere(np.ones(np.subtract(high, low))) + low
    sides = []
    for side, (axis, end) in enumerate([(2, 0), (2, 1), (1, 0), (1, 1), (0, 0), (0, 1)]):
        for cell in cells[cells[:, axis] == (high[axis] - 1 if end else low[axis])]:
            vertices, faces = cube(cell, cell + 1, NO, facing)
            sides.append((vertices, faces[2 * side : 2 * side + 2]))
    return joined(*sides)


@pytest.mark.parametrize("known", [merged, soup])
@pytest.mark.parametrize(
    ("low", "high"),
    [
        ([0, 0, 0], [2, 2, 2]),  # at a corner: three sides of each lie upon each other
        ([0, 0, 1], [2, 2, 3]),  # at an edge
        ([0, 1, 1], [2, 3, 3]),  # at a wall
        ([2, 1, 1], [4, 3, 3]),
        ([0, 0, 0], [2, 4, 4]),  # all of one end
    ],
)
def test_a_cavity_at_the_wall_takes_its_place_away_when_they_share_vertices(known, low, high):
    mesh = known(joined(gridded([0, 0, 0], [8, 4, 4]), gridded(low, high, -1)))
    points = np.random.default_rng(1).uniform(-0.5, [8.5, 4.5, 4.5], (3000, 3))
    points = points[(np.abs(points - np.rint(points)) > 0.02).all(axis=1)]
    solid = ((points > 0) & (points < [8, 4, 4])).all(axis=1)
    hollow = ((points > low) & (points < high)).all(axis=1)
    assert np.array_equal(inside(mesh, points), solid & ~hollow)
    cells = np.zeros((10, 6, 6), bool)
    cells[1:9, 1:5, 1:5] = True
    cells[tuple(slice(a + 1, b + 1) for a, b in zip(low, high, strict=True))] = False
    walls = sum(int((np.diff(cells.astype(int), axis=axis) != 0).sum()) for axis in range(3))
    cleaned = clean(*mesh)
    surface = MeshDistance(cleaned, np.random.default_rng(0))
    area = areas(surface.vertices[surface.faces]).sum() * cleaned.scale**2
    assert area == pytest.approx(walls)


def test_crossing_bars_in_the_same_box_are_no_copies():
    bars = []
    for angle in (np.pi / 4, -np.pi / 4):
        bar = trimesh.creation.box((2, 0.3, 0.3))
        bar.apply_transform(trimesh.transformations.rotation_matrix(angle, [0, 0, 1]))
        bars.append((bar.vertices, bar.faces))
    points = np.array([[0.5, 0.5, 0], [0.5, -0.5, 0], [0, 0, 0], [0.5, 0, 0]])
    assert inside(joined(*bars), points).tolist() == [True, True, True, False]


def unsewn(mesh, rng, filled):
    """A mesh with vertices amid some of its edges that only one of their two faces knows; `filled`
    with triangles without an area."""
    points, faces = [*mesh.vertices], [tuple(face) for face in mesh.faces]
    made = []
    for number in rng.permutation(len(faces))[: len(faces) // 3]:
        a, b, c = faces[number]
        share = rng.uniform(0.2, 0.8)
        points.append((1 - share) * points[a] + share * points[b])
        new = len(points) - 1
        made += [(a, new, c), (new, b, c)]
        faces[number] = None
        if filled:
            made.append((a, b, new))
    return np.array(points), np.array([face for face in faces if face] + made)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), filled=st.booleans(), single=st.booleans())
def test_edges_are_split_where_vertices_of_others_lie_on_them(seed, filled, single):
    rng = np.random.default_rng(seed)
    shape = trimesh.creation.torus(1, 0.4, major_sections=9, minor_sections=6)
    shape.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    points, faces = unsewn(shape, rng, filled)
    mesh = clean(points.astype(np.float32 if single else np.float64), faces)
    assert border(mesh) == 0
    made = trimesh.Trimesh(mesh.vertices * mesh.scale, mesh.triangles, process=False)
    assert made.volume == pytest.approx(shape.volume, rel=1e-5)
    assert made.area == pytest.approx(shape.area, rel=1e-5)
    thick = prepare(mesh, Open.THICKNESS)
    assert thick.mesh is mesh
    assert not thick.notes


def test_a_side_that_is_divided_more_finely_is_sewn_to_the_others():
    """All of its rim at once, and more vertices than one on each edge."""
    fine = trimesh.creation.box((2, 2, 2)).subdivide().subdivide()
    top = fine.triangles_center[:, 2] > 0.99
    coarse = trimesh.creation.box((2, 2, 2))
    rest = coarse.faces[coarse.triangles_center[:, 2] < 0.99]
    mesh = clean(*joined((fine.vertices, fine.faces[top]), (coarse.vertices, rest)))
    assert border(mesh) == 0
    assert len(np.unique(mesh.pieces)) == 1
    assert mesh.repairs["sewn"] == 12


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_vertices_that_are_nearly_equal_are_welded_wherever_they_lie(seed):
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(3, 1.0)
    soup = ball.vertices[ball.faces].reshape(-1, 3)
    soup = soup + rng.uniform(-3e-7, 3e-7, soup.shape) + rng.uniform(-1, 1, 3)
    mesh = clean(soup, np.arange(len(soup)).reshape(-1, 3))
    assert border(mesh) == 0
    assert len(mesh.vertices) == len(ball.vertices)


def test_an_opening_stays_open():
    box = trimesh.creation.box((2, 2, 2)).subdivide()
    box.update_faces(box.triangles_center[:, 2] < 0.99)
    mesh = clean(box.vertices, box.faces)
    assert border(mesh) == 8
    assert "sewn" not in mesh.repairs
