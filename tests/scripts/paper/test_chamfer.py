# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances of the paper's tables, by surfaces on which they are known."""

import numpy as np
import pytest
import trimesh
from paper.measures.chamfer import Chamfer, both_ways, tube_of
from paper.measures.ground import displaced_mesh, divided
from paper.measures.measures import angles, measure
from paper.measures.surface import FieldSurface, MeshSurface
from paper.methods.mesh_edit import decimated

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import Preparation, prepare
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball, ellipsoid, siren

RADIUS, HEIGHT = 0.1, 0.04


def sphere(radius, subdivisions=4):
    mesh = trimesh.creation.icosphere(subdivisions, radius)
    return MeshSurface(np.array(mesh.vertices), np.array(mesh.faces))


@pytest.fixture(scope="module")
def preparation():
    field = ball(0.5)
    return Preparation(field, extract(field, 64))


@pytest.fixture(scope="module")
def problem(preparation):
    turn = np.linspace(-0.5, 0.5, 12)
    points = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    return pose(preparation, Stroke(points, Brush(RADIUS, HEIGHT)))


def test_the_chamfer_distance_of_points_counted_by_hand():
    """From a: 1 and 2, from b: 1, 2 and 5: 1.5 + 8 / 3."""
    a = np.array([[0.0, 0, 0], [10, 0, 0]])
    b = np.array([[0.0, 1, 0], [10, 0, 2], [10, 5, 0]])
    assert both_ways(a, b) == pytest.approx(1.5 + 8 / 3)
    assert both_ways(b, a) == both_ways(a, b)


def test_the_noise_floor_of_a_sphere():
    """Of N random points on area A the nearest is 1/2 sqrt(A / N) away; there and back twice it."""
    surface = sphere(0.5)
    chamfer = Chamfer(surface, lambda points: points[:, 2] > 0.3, 20_000, 0)
    assert chamfer.floor["whole_floor"] == pytest.approx(np.sqrt(np.pi / 20_000), rel=0.02)
    cap = np.pi * 0.2  # 2 pi r h
    assert chamfer.floor["tube_floor"] == pytest.approx(np.sqrt(cap / 20_000), rel=0.02)
    same = chamfer.of(surface)
    assert same["whole"] == pytest.approx(chamfer.floor["whole_floor"], rel=0.02)
    assert same["tube"] == pytest.approx(chamfer.floor["tube_floor"], rel=0.02)


def test_the_chamfer_distance_of_concentric_spheres():
    chamfer = Chamfer(sphere(0.5), lambda points: points[:, 2] > 0, 20_000, 0)
    assert chamfer.of(sphere(0.6))["whole"] == pytest.approx(0.2, rel=0.02)


def test_the_tube_is_a_ball_about_each_point_of_the_path(problem):
    inside = tube_of(problem)
    assert inside(np.array([[0.5 + 0.99 * RADIUS, 0, 0], [0.5, 0, 0.99 * RADIUS]])).all()
    assert not inside(np.array([[0.5 + 1.01 * RADIUS, 0, 0], [0.5, 0, 1.01 * RADIUS]])).any()


def test_a_field_and_a_mesh_are_seen_alike(preparation):
    points = np.random.default_rng(0).normal(size=(500, 3))
    points *= 0.52 / np.linalg.norm(points, axis=1, keepdims=True)
    for surface in (FieldSurface(preparation.field, preparation.proxy, 0), sphere(0.5, 5)):
        seen = surface.see(points)
        assert seen.distance == pytest.approx(0.02, abs=4e-4)
        assert angles(seen.normals, points / 0.52).max() < 1
        drawn = surface.sample(3000, 0)
        assert np.linalg.norm(drawn, axis=1) == pytest.approx(0.5, abs=4e-4)


@pytest.mark.long
def test_samples_of_a_field_lie_on_sheets_that_a_proxy_misses(preparation):
    """Four plates, 0.011 thick, in the middle between points of the proxy's lattice."""
    wave, middle = 4 * np.pi, 1 / 128
    plates = Field(siren(([[0, 0, wave]], [-np.pi / 2 - wave * middle]), ([[1.0]], [0.99761])))
    with pytest.raises(SculptError, match="no surface"):
        extract(plates, 128)
    drawn = FieldSurface(plates, preparation.proxy, 0).sample(3000, 0)
    places, counts = np.unique(np.round((drawn[:, 2] - middle) * 2), return_counts=True)
    assert len(places) == 4
    assert counts.min() > 600


def test_small_angles_of_float32_vectors():
    """A ten-thousandth of a degree, whose cosine is 1 in float32."""
    turn = np.radians([0, 1e-4, 1e-2, 1, 90, 180])
    one = np.tile(np.float32([1, 0, 0]), (len(turn), 1))
    other = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1).astype(np.float32)
    assert angles(one, other) == pytest.approx(np.degrees(turn), rel=1e-4, abs=1e-7)


def test_samples_in_a_region_lie_in_it_and_are_as_many_as_asked():
    """Also where its triangles have many points outside of it."""
    surface = sphere(0.5, 2)
    drawn = surface.sample(2500, 0, lambda points: points[:, 2] > 0.4)
    assert len(drawn) == 2500
    assert (drawn[:, 2] > 0.4).all()
    with pytest.raises(ValueError, match="does not reach"):
        surface.sample(10, 0, lambda points: points[:, 2] > 2)


def test_the_size_of_a_mesh_is_that_of_its_arrays():
    """12 vertices of six floats, 20 triangles of three indices, four bytes each."""
    assert sphere(1.0, 0).bytes == 12 * 24 + 20 * 12


def test_the_ground_truth_is_the_displaced_sphere(preparation, problem):
    """At an angle a beside the path the surface rises by s b(2 R sin(a / 2) / r)."""
    truth = displaced_mesh(problem, preparation.proxy)
    mesh = trimesh.Trimesh(truth.vertices, truth.triangles, process=False)
    assert mesh.is_watertight
    x, y, z = truth.vertices.T
    radius = np.linalg.norm(truth.vertices, axis=1)
    beside = np.abs(np.arctan2(y, x)) < 0.45
    chord = np.sin(np.abs(np.arcsin(z / radius)) / 2)  # from the great circle, of the diameter
    v = np.minimum(chord / RADIUS, 1)  # 2 R = 1
    asked = 0.5 + HEIGHT * (1 - v**3 * (10 - 15 * v + 6 * v**2))
    assert radius[beside] == pytest.approx(asked[beside], abs=1e-4)


def test_edges_under_the_stroke_are_halved_twice_and_others_not(preparation, problem):
    samples, triangles = divided(problem, preparation.proxy)
    edge = np.linalg.norm(samples.points[triangles[:, 0]] - samples.points[triangles[:, 1]], axis=1)
    middle = samples.points[triangles].mean(axis=1)
    turn = np.arctan2(middle[:, 1], middle[:, 0])
    under = (np.abs(turn) < 0.4) & (np.abs(middle[:, 2]) < 0.05)
    away = middle[:, 0] < 0
    assert np.median(edge[under]) == pytest.approx(np.median(edge[away]) / 4, rel=0.2)


def test_the_ground_truth_of_a_carve_through_a_thin_part_ends_at_its_other_side():
    """A dab deeper than a lens is thick: where its floor would lie beyond, there is a hole."""
    lens = prepare(ellipsoid((0.5, 0.5, 0.05)))
    problem = pose(lens, Stroke(np.array([[0, 0, 0.05]]), Brush(0.15, -0.2)))
    truth = displaced_mesh(problem, lens.proxy)
    points = truth.sample(20_000, 0, lambda points: np.hypot(*points[:, :2].T) < 0.15)
    away = np.linspace(0, 0.15, 1501)
    face = 0.05 * np.sqrt(1 - (away / 0.5) ** 2)
    hole = away[face - 0.2 * problem.stroke.brush.profile(away / 0.15) < -face].max()
    cell = 2 / 128  # of the far side's triangles; those under the dab are a quarter as large
    assert points[:, 2].min() > -0.05 - 3 * cell / 4  # the wall is as steep as three to one
    assert hole - 1.5 * cell < np.hypot(*points[:, :2].T).min() < hole + cell


@pytest.mark.long
def test_the_ground_truth_has_no_hollow_that_nothing_opens():
    """Two ridges close the hole of the torus, 0.3 wide, 0.06 above and below its middle."""
    ridges = Profile(points=((-1, 0), (-0.6, 1), (0, 0.4), (0.6, 1), (1, 0)))
    torus = prepare(primitive("torus"))
    turn = np.linspace(0, 2 * np.pi, 33)[:-1]
    points = 0.3 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    problem = pose(torus, Stroke(points, Brush(0.1, 0.33, ridges), closed=True))
    truth = displaced_mesh(problem, torus.proxy)
    used = truth.vertices[np.unique(truth.triangles)]
    within = (np.hypot(*used[:, :2].T) < 0.25) & (np.abs(used[:, 2]) < 0.04)
    assert not within.any()
    assert (np.hypot(*used[:, :2].T) < 0.1).any()


def test_the_ground_truth_has_no_distance_from_itself(preparation, problem):
    truth = displaced_mesh(problem, preparation.proxy)
    found = measure(problem, truth, truth, tube_of(problem), 5000)
    assert found["asked"] < 1e-4
    assert found["back"] < 1e-9
    assert found["drift"] < 5e-4  # h^2 / 4 R: how far chords of 64 cells lie below the sphere
    assert found["normal"] < 2 and found["turned"] < 2


def test_without_an_edit_all_of_the_displacement_is_missing(preparation, problem):
    """Of samples even in v the mean of s b(v) is s / 2."""
    before = FieldSurface(preparation.field, preparation.proxy, 0)
    truth = displaced_mesh(problem, preparation.proxy)
    found = measure(problem, before, truth, tube_of(problem), 100)
    assert found["asked"] == pytest.approx(HEIGHT / 2, rel=0.03)
    assert found["drift"] < 1e-6 and found["turned"] < 0.1


def test_the_coarse_mesh_has_the_size_of_the_network(preparation):
    """17,153 float32 parameters: 2858 triangles, 1431 vertices by Euler's formula."""
    mesh = decimated(extract(preparation.field, 96), 4 * 17_153)
    assert mesh.bytes == pytest.approx(4 * 17_153, rel=0.01)
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(0.5, abs=2e-3)
    assert trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).is_watertight
