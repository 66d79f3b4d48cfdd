# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures against edits whose errors are known, and against a dense mesh of the edited field."""

from dataclasses import replace

import igl
import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial import KDTree
from skimage.measure import marching_cubes

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.levels import Level, cells_of, linear, quantised, spacing
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem import metrics
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball, eight_balls, ellipsoid, thin_lens
from tests.field.networks import MODELS, network_of

EVERYWHERE = Profile(table=(1, 1))


def belt(radius, intensity, profile=EVERYWHERE):
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]
    points = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    return Stroke(points, Brush(radius, intensity, profile), closed=True)


def shifted(field, way):
    """The field moved by `way`."""
    weight, bias, *rest = field.network.parameters
    return Field(field.network.with_parameters([weight, bias - weight @ torch.tensor(way), *rest]))


def caps(count):
    """Directions within 0.5 of either pole."""
    random = np.random.default_rng(0)
    angle, turn = random.uniform(0, 0.5, count), random.uniform(0, 2 * np.pi, count)
    flat, z = np.sin(angle), np.cos(angle) * random.choice([-1, 1], count)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)


def distinct(index, numbers):
    """Indices, each once and rising, and the first of their numbers."""
    found, first = np.unique(index, return_index=True)
    return found, quantised(numbers[first])


def measured(problem, edited):
    return metrics.measure(problem, edited, extract(edited))


def chamfer(problem, edited):
    return metrics.chamfer(problem, edited, extract(edited))


def dense_mesh(edited, cells=160, reach=0.62):
    """Marching cubes on every cell of a box, evaluated here and not by the proxy."""
    axis = np.linspace(-reach, reach, cells + 1, dtype=np.float32)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    field = values(edited, grid).reshape((cells + 1,) * 3)
    vertices, triangles, _, _ = marching_cubes(field, 0.0)
    return vertices * 2 * reach / cells - reach, triangles


def to_mesh(points, vertices, triangles):
    squared = igl.point_mesh_squared_distance(
        np.asarray(points, float), vertices, triangles.astype(np.int64)
    )[0]
    return np.sqrt(squared)


def test_an_oracle_has_no_error(preparation):
    """A stroke that raises all of a sphere by 0.03, and the sphere that is 0.03 larger."""
    problem = pose(preparation, belt(0.9, 0.03))
    report = measured(problem, ball(0.53))
    for measure in ("tube_mean", "tube_p95", "tube_max"):
        assert report[measure] < 2e-5
    assert report["normal_deg"] < 0.1
    assert report["gradient"] < 1e-3
    for measure in ("cap_mean", "rim_mean", "drift_mean", "drift_p99", "drift_max"):
        assert report[measure] is None
    assert (report["components_before"], report["components_after"]) == (1, 1)


def test_a_known_error_is_reported_as_it_is(preparation):
    """The edit was to raise a band 0.4 wide by 0.03, with walls beside it; instead the whole sphere
    grew by 0.01. Of the band 0.36 are 0.02 off, and 0.04 within that of a wall, half as far. Beside
    it 0.02 are nearer to a wall than to what stays 0.01 below."""
    report = measured(pose(preparation, belt(0.2, 0.03)), ball(0.51))
    assert report["tube_mean"] == pytest.approx(0.02, rel=0.01)
    assert report["tube_max"] == pytest.approx(0.02, rel=0.02)
    assert report["reverse_max"] == pytest.approx(0.02, rel=0.05)
    mean = (0.36 * 0.02 + 0.04 * 0.01 + 0.02 * 0.005) / 0.42
    assert report["reverse_mean"] == pytest.approx(mean, rel=0.03)
    for measure in ("rim_mean", "drift_mean", "drift_p99", "drift_max"):
        assert report[measure] == pytest.approx(0.01, rel=0.005)
    assert report["gradient"] == pytest.approx(0.53 / 0.51 - 1, abs=1e-3)


def test_the_way_back_of_overlapping_mirror_images_is_that_of_both(preparation):
    """Two ridges beside the plane of the mirror, between which those of the image lie: what only
    one of both has raised is no error of the other."""
    turn = np.linspace(-0.8, 0.8, 17)
    side = np.full(17, 0.03)
    flat = np.sqrt(0.25 - side**2)
    points = np.stack([side, flat * np.sin(turn), flat * np.cos(turn)], axis=1)
    ridges = Profile(points=((-1, 0), (-0.5, 1), (0, 0), (0.5, 1), (1, 0)))
    edit = sculpt(preparation, Stroke(points, Brush(0.08, 0.05, ridges), mirror=frozenset("X")))
    assert edit.report()["reverse_p95"] < 1e-3


@pytest.mark.parametrize(
    ("word", "radius", "height"), [("radius", 0.2, 0.02), ("intensity", 0.06, 0.2)]
)
def test_pressure_is_measured_as_what_it_draws(preparation, word, radius, height):
    """A tenth of the radius, or of the intensity, and ten times the pressure."""
    drawn = belt(radius, height, Profile("quintic"))
    pressed = replace(
        drawn,
        brush=replace(drawn.brush, **{word: getattr(drawn.brush, word) / 10}),
        **{f"{word}_factors": np.full(len(drawn.points), 10.0)},
    )
    edited = ball(0.5 + 0.8 * height)
    one, other = (measured(pose(preparation, stroke), edited) for stroke in (drawn, pressed))
    assert one["reverse_max"] > 0.1 * height
    for measure in ("reverse_mean", "reverse_p95", "tube_mean", "gain"):
        assert other[measure] == pytest.approx(one[measure], rel=1e-3)


@pytest.mark.parametrize("radius", [0.004, 0.02])
def test_the_way_back_of_a_stroke_thinner_than_a_cell_is_measured(preparation, radius):
    """A dab that was asked for and not made: its top is missing."""
    height = radius / 8
    problem = pose(preparation, Stroke(np.array([[0, 0, 0.5]]), Brush(radius, height)))
    report = measured(problem, ball(0.5))
    assert report["reverse_max"] == pytest.approx(height, rel=0.15)
    assert not report["tolerance_met"]


def test_what_shall_leave_the_box_is_told():
    """A dab on a ball of radius 0.9 that shall end 0.05 beyond the box."""
    field = ball(0.9)
    stroke = Stroke(np.array([[0, 0, 0.9]]), Brush(0.1, 0.15))
    report = sculpt(prepare(field), stroke).report()
    assert 0 < report["outside"] < 0.6
    assert not report["tolerance_met"]
    assert "leaves the box" in report["notes"][0]
    inside = sculpt(prepare(field), replace(stroke, brush=Brush(0.1, 0.05))).report()
    assert inside["outside"] == 0
    assert "notes" not in inside


def test_the_reverse_distance_is_of_the_stroke_alone(preparation):
    """A dab at a pole is where it shall be; of the other one, which is raised, nothing counts."""
    edit = sculpt(preparation, Stroke(np.array([[0, 0, 0.5]]), Brush(0.2, 0.03)))
    below = caps(400)
    index = np.unique(linear(cells_of(0.5 * below[below[:, 2] < 0], 4), 4))
    raised = edit.field.plus({4: Level(index, quantised(np.full(len(index), -0.03)))})
    report, alone = measured(edit.problem, raised), edit.report()
    for measure in ("reverse_mean", "reverse_p95", "reverse_max"):
        assert report[measure] == pytest.approx(alone[measure], rel=0.01)
    assert report["drift_max"] > 0.02


@pytest.mark.parametrize(
    ("asked", "radius", "gain"),
    [
        *((0.03, 0.53, 1), (0.03, 0.515, 0.5), (0.03, 0.5, 0), (0.03, 0.545, 1.5)),
        *((-0.02, 0.485, 0.75), (0.0, 0.5, 1)),
    ],
)
def test_the_gain_is_the_share_of_the_displacement_that_was_reached(
    preparation, asked, radius, gain
):
    report = measured(pose(preparation, belt(0.9, asked)), ball(radius))
    assert report["gain"] == pytest.approx(gain, abs=0.03)
    assert report["height"] == pytest.approx(abs(asked), rel=1e-6)


def test_normals_of_the_untouched_surface_turn_when_it_is_shifted(preparation):
    """By d sin(a) / R at an angle a from the way that a sphere was moved by d: here along z."""
    d = 0.005
    report = measured(pose(preparation, belt(0.2, 0.03)), shifted(ball(0.5), (0, 0, d)))
    low = np.sin(2 * np.arcsin(0.28))  # z / R where 1.4 radii away from the equator
    square = 1 - (1 - low**3) / 3 / (1 - low)  # mean of sin^2 over the caps
    most = np.degrees(d / 0.5) * np.sqrt(1 - low**2)
    assert report["untouched_normal_rms"] == pytest.approx(
        np.degrees(d / 0.5) * np.sqrt(square), rel=0.02
    )
    assert report["untouched_normal_max"] == pytest.approx(most, rel=0.02)
    assert abs(report["untouched_worst"][2]) == pytest.approx(0.5 * low, abs=0.01)
    assert report["drift_mean"] == pytest.approx(d * (1 + low) / 2, rel=0.02)
    assert not report["tolerance_met"]


@pytest.mark.parametrize(
    ("height", "reached", "cell", "tolerance", "met"),
    [
        (0.03, 1.0, 0.0, 1e-3, True),
        (0.03, 0.975, 0.0, 1e-3, True),  # 0.75e-3 are missing
        (0.03, 0.96, 0.0, 1e-3, False),  # 1.2e-3
        (0.004, 0.98, 0.0, 4e-4, True),
        (0.004, 0.95, 0.0, 4e-4, False),  # 2e-4, but they are a twentieth
        (0.004, 0.98, 0.04, 2e-3, True),
        (-0.02, 0.98, 0.0, 1e-3, True),
    ],
)
def test_the_tolerance_follows_the_height(preparation, height, reached, cell, tolerance, met):
    edited = ball(0.5 + reached * height)
    problem = pose(preparation, belt(0.9, height))  # all of it: there is no wall beside it
    report = metrics.measure(problem, edited, extract(edited), cell=cell)
    assert report["tolerance"] == pytest.approx(tolerance, rel=1e-6)
    assert report["tube_p95"] == pytest.approx((1 - reached) * abs(height), abs=3e-5)
    assert report["tolerance_met"] is met


def test_a_tolerance_is_not_met_with_ripples_or_loose_pieces(preparation):
    """They lie on the caps and outside, far from what the stroke displaced."""
    edit = sculpt(preparation, belt(0.2, 0.03, Profile("quintic")))
    assert edit.report()["tolerance_met"]
    index = linear(cells_of(0.5 * caps(400), 6), 6)
    noise = np.random.default_rng(1).normal(0, 1e-3, len(index))
    ripples = edit.field.plus({6: Level(*distinct(index, noise))})
    report = measured(edit.problem, ripples)
    assert report["tube_p95"] < report["tolerance"] and report["gain"] > 0.97
    assert 0.3 < report["untouched_normal_rms"] < 10
    assert not report["tolerance_met"]
    corner = linear(cells_of(np.array([[0.6, 0.6, 0.6]]), 3), 3)
    drop = {3: Level(corner, np.float32([-2.0]))}
    loose = edit.field.plus(drop).plus(drop)
    report = measured(edit.problem, loose)
    assert report["untouched_normal_rms"] < 0.01
    assert (report["components_after"], report["tolerance_met"]) == (2, False)


def test_what_no_layer_reached_need_not_be_measured(preparation):
    edit = sculpt(preparation, belt(0.2, 0.03, Profile("quintic")))
    some, all_ = edit.report(), measured(edit.problem, edit.field)
    for name in ("tube_mean", "tube_p95", "reverse_p95", "gain", "rim_mean", "normal_deg"):
        assert some[name] == pytest.approx(all_[name], rel=0.02)
    for name in ("drift_mean", "drift_p99"):
        assert some[name] == pytest.approx(all_[name], abs=1e-6)
    assert some["untouched_normal_rms"] == pytest.approx(all_["untouched_normal_rms"], abs=0.02)


def test_no_edit_has_no_drift_and_the_whole_displacement_as_error(preparation):
    """The mean over the tube of b of the chord from the path, which falls off quintically.

    Samples are even in the tangent plane of a ball of radius 1/2 and go along its radii.
    """
    stroke = belt(0.2, -0.03, Profile("quintic"))
    report = measured(pose(preparation, stroke), preparation.field)
    across = (np.arange(10_000) + 0.5) / 10_000 * 0.2
    t = np.sin(np.arctan(across / 0.5) / 2) / 0.2
    falloff = 1 - t**3 * (10 - 15 * t + 6 * t**2)
    assert report["tube_mean"] == pytest.approx(0.03 * falloff.mean(), rel=1e-3)
    assert report["tube_max"] == pytest.approx(0.03, rel=0.005)
    assert report["drift_max"] < 1e-4
    assert report["rim_mean"] < 1e-5
    assert report["gradient"] < 0.07


def test_a_dab_is_all_cap_and_its_tube_measures_are_the_same(preparation):
    stroke = Stroke(np.array([[0, 0, 0.5]]), Brush(0.2, 0.03, EVERYWHERE))
    report = measured(pose(preparation, stroke), preparation.field)
    assert report["tube_mean"] == pytest.approx(0.03, rel=0.01)
    assert report["cap_mean"] == report["tube_mean"]


def test_caps_are_apart_from_the_core(preparation):
    turn = np.linspace(0, 1.5, 12)
    points = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    open_belt = Stroke(points, Brush(0.1, 0.03, EVERYWHERE))
    report = measured(pose(preparation, open_belt), ball(0.53))
    assert report["tube_mean"] < 1e-4
    assert report["cap_mean"] < 1e-4
    assert report["drift_mean"] == pytest.approx(0.03, rel=0.01)


def test_the_report_agrees_with_a_dense_mesh_of_the_edited_field(sculpted):
    """Nothing in common with the measures but the edited network."""
    report = measured(sculpted.problem, sculpted.field)
    mesh = dense_mesh(sculpted.field)
    random = np.random.default_rng(5)
    turn = random.uniform(0, 2 * np.pi, 40_000)
    # Offsets are uniform in the tangent plane: a place v along the meridian's tangent.
    latitude = np.arctan(random.uniform(-0.25, 0.25, 40_000) / 0.5)
    flat = np.cos(latitude)
    n = np.stack([flat * np.cos(turn), flat * np.sin(turn), np.sin(latitude)], axis=1)
    t = np.abs(np.sin(latitude / 2)) / 0.25
    target = n * (0.5 + 0.04 * (1 - 10 * t**3 + 15 * t**4 - 6 * t**5))[:, None]
    error = to_mesh(target, *mesh)
    assert report["tube_mean"] == pytest.approx(error.mean(), rel=0.03, abs=5e-5)
    assert report["tube_p95"] == pytest.approx(np.percentile(error, 95), rel=0.03, abs=1e-4)
    assert report["tube_max"] == pytest.approx(error.max(), rel=0.1)

    n = random.normal(size=(40_000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    away = np.abs(np.sin(np.arcsin(n[:, 2]) / 2)) / 0.25
    moved = to_mesh(0.5 * n, *mesh)
    assert report["drift_mean"] == pytest.approx(moved[away > 1.4].mean(), rel=0.03, abs=5e-5)
    p99 = np.percentile(moved[away > 1.4], 99)
    assert report["drift_p99"] == pytest.approx(p99, rel=0.05, abs=1e-4)
    rim = moved[(away > 1) & (away < 1.4)].mean()
    assert report["rim_mean"] == pytest.approx(rim, rel=0.03, abs=5e-5)

    # The edited surface near the stroke against a dense cloud of the target.
    latitude = np.linspace(-0.505, 0.505, 700)
    t = np.abs(np.sin(latitude / 2)) / 0.25
    radius = 0.5 + 0.04 * (1 - 10 * t**3 + 15 * t**4 - 6 * t**5) * (t < 1)
    profile = KDTree(np.stack([radius * np.cos(latitude), radius * np.sin(latitude)], axis=1))
    x, y, z = mesh[0].T
    near = np.abs(np.arctan2(z, np.hypot(x, y))) < 0.455  # where the samples end
    reverse = profile.query(np.stack([np.hypot(x, y), z], axis=1)[near])[0]
    assert report["reverse_mean"] == pytest.approx(reverse.mean(), rel=0.06, abs=1e-4)


def test_distance_to_a_surface_is_the_distance_to_its_mesh():
    field = ellipsoid((0.55, 0.4, 0.3))
    random = np.random.default_rng(3)
    n = random.normal(size=(3000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    x = n * (0.55, 0.4, 0.3) * random.uniform(0.92, 1.08, (3000, 1))
    found = find_surface(field, x).distance
    exact = to_mesh(x, *dense_mesh(field))
    assert np.abs(found - exact).max() < 1e-3
    assert np.abs(found - exact).mean() < 1e-4


def test_far_points_are_no_nearer_than_they_are():
    """Where projection does not arrive, the estimate must not be zero."""
    found = find_surface(ball(0.3), [[0.95, 0, 0], [0.9, 0.3, 0.1], [0, 0, 0]]).distance
    assert (found > [0.6, 0.6, 0.2]).all()


def test_components_are_those_of_trimesh():
    proxy = extract(eight_balls(), 64)
    assert components(proxy) == 8
    mesh = trimesh.Trimesh(proxy.vertices, proxy.triangles, process=False)
    assert components(proxy) == len(mesh.split(only_watertight=False))
    shuffled = np.random.default_rng(0).permutation(len(proxy.triangles))
    assert components(replace(proxy, triangles=proxy.triangles[shuffled])) == 8
    assert components(extract(ball(0.5), 32)) == 1


@pytest.mark.parametrize("model", MODELS)
def test_pieces_of_networks_are_those_of_trimesh(model):
    proxy = extract(network_of(model), 64)
    mesh = trimesh.Trimesh(proxy.vertices, proxy.triangles, process=False)
    assert components(proxy) == mesh.body_count


def test_the_chamfer_floor_is_that_of_random_points(preparation):
    """Of N random points on area A the nearest is 1/2 sqrt(A / N) away; there and back twice it."""
    longitude, latitude = np.linspace(0, 6 * np.pi, 60), np.linspace(-1.5, 1.5, 60)
    path = 0.5 * np.stack(
        [
            np.cos(longitude) * np.cos(latitude),
            np.sin(longitude) * np.cos(latitude),
            np.sin(latitude),
        ],
        axis=1,
    )
    everywhere = Stroke(path, Brush(0.4, 0.03, Profile(table=(1.0, 1.0))))
    report = chamfer(pose(preparation, everywhere), ball(0.53))
    floor = np.sqrt(4 * np.pi * 0.53**2 / 100_000)
    assert report["chamfer_floor"] == pytest.approx(floor, rel=0.01)
    assert report["chamfer"] == pytest.approx(floor, rel=0.01)


def test_samples_of_both_surfaces_are_drawn_apart(preparation):
    """Without an edit, too, the distance is that of two samplings and not of one to itself."""
    report = chamfer(pose(preparation, belt(0.2, 0.0)), preparation.field)
    assert report["chamfer"] == pytest.approx(report["chamfer_floor"], rel=0.02)


@pytest.mark.long
def test_the_chamfer_distance_of_concentric_spheres(preparation):
    """0.02 apart: of N random points on area A the nearest is aside by A / (pi N) in the mean of
    the square."""
    report = chamfer(pose(preparation, belt(0.9, 0.0)), ball(0.52))
    aside = 4 * 0.5**2 / 100_000
    assert report["chamfer"] == pytest.approx(2 * np.sqrt(0.02**2 + aside), rel=0.01)


def test_the_known_floor_of_a_sphere():
    """6.74e-3: two samplings of a sphere of radius 0.6, measured by others with their own code."""
    field = primitive("sphere")
    problem = pose(
        prepare(field), Stroke(np.array([[-0.397437, -0.262747, 0.364709]]), Brush(0.08, 0.0))
    )
    report = chamfer(problem, field)
    assert report["chamfer_floor"] == pytest.approx(6.74e-3, rel=0.01)
    assert report["chamfer"] == pytest.approx(6.74e-3, rel=0.015)


def test_the_same_seed_measures_the_same(sculpted):
    first = measured(sculpted.problem, sculpted.field)
    assert measured(sculpted.problem, sculpted.field) == first


HOLE = Profile(points=((-1, 0), (-0.8, 1), (0.8, 1), (1, 0)))


@pytest.fixture(scope="module")
def lens():
    return prepare(thin_lens())


def drilled(lens, depth, radius=0.15):
    """A flat-floored carve in the middle of a lens 0.1 thick, as wide as 0.8 to 1 of `radius`."""
    return sculpt(lens, Stroke(np.array([[0, 0, 0.05]]), Brush(radius, -depth, HOLE)))


def test_a_hole_is_measured_by_its_walls(lens):
    """Its far sheet is no surface any more: what was there, up to 0.13 from the rest, has not
    drifted, and the walls that came in its place were asked for. Only the new edge is round."""
    report = drilled(lens, 0.2).report()
    assert report["components_after"] == 1
    assert report["drift_p99"] < 1e-3
    assert report["drift_max"] < 6e-3  # 0.4 cells
    assert report["reverse_p95"] < 2e-3


@pytest.mark.long
def test_the_round_edge_of_a_hole_is_rim(lens):
    """The far sheet, 0.1 below, is reached 0.904 radii away from the middle. Within two cells of
    there its normals turn most, for splines round the edge."""
    edit = drilled(lens, 0.2)
    cell = spacing(max(edit.layer))
    every, rest = measured(edit.problem, edit.field), edit.report()
    away = [np.linalg.norm(found["untouched_worst"][:2]) - 0.904 * 0.15 for found in (every, rest)]
    assert abs(away[0]) < 1.5 * cell
    assert away[1] > 2 * cell - 1e-3
    assert every["untouched_normal_max"] > 3 * rest["untouched_normal_max"]
    assert rest["rim_mean"] > every["rim_mean"]


@pytest.mark.parametrize("radius", [0.05, 0.15])
def test_a_film_that_is_left_in_a_hole_is_as_far_off_as_its_walls(lens, radius):
    """A carve 0.08 deep leaves the lens 0.02 thick where it was to be a hole, as wide as 0.9 radii
    at the far sheet, of which triangles reach up to a cell of the proxy into the hole."""
    asked, left = drilled(lens, 0.2, radius).problem, drilled(lens, 0.08, radius)
    measures = metrics.measure(asked, left.field, left.proxy)
    assert 0.9 * radius - lens.spacing < measures["reverse_max"] < 1.2 * radius


@pytest.mark.long
def test_a_dent_beside_a_hole_is_seen(lens):
    """On the far sheet, 0.05 from the hole's edge, where the swept volume is near."""
    edit = drilled(lens, 0.2)
    level, place = 6, np.float32([[0.2, 0, -0.05 * np.sqrt(1 - 0.4**2)]])
    cells = linear(cells_of(place, level), level)
    dented = edit.field.plus({level: Level(*distinct(cells, np.array([0.02])))})
    depth = find_surface(dented, place).distance[0]
    measures = measured(edit.problem, dented)
    assert depth > 2e-3
    assert measures["drift_max"] > 0.8 * depth
