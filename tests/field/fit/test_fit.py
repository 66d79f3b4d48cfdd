# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitting meshes: against closed forms, autograd and trimesh; damaged meshes; messages."""

import json

import igl
import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.fit import mesh_cleanup, schedule
from neural_sculpt_addon.field.fit.fit import TOLERANCES, fit_mesh
from neural_sculpt_addon.field.fit.fit_distance import (
    GRADIENT_WEIGHT,
    SOFTNESS,
    TrainingSamples,
    loss_gradients,
)
from neural_sculpt_addon.field.fit.fit_paper import paper_loss
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance
from neural_sculpt_addon.field.fit.mesh_open import Open, openings, prepare
from neural_sculpt_addon.field.fit.mesh_thicken import thicken
from neural_sculpt_addon.field.levels import centres, places, spacing
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.field.solve.adam import Adam

SPHERE = trimesh.creation.icosphere(subdivisions=4)
TORUS = trimesh.creation.torus(0.5, 0.2, major_sections=96, minor_sections=48)
BOX = trimesh.creation.box((1.7, 1.2, 0.8))
TURN = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])[:3, :3]
COARSE = trimesh.creation.icosphere(subdivisions=2)


def distance_to(vertices, triangles):
    return MeshDistance(clean(vertices, triangles), np.random.default_rng(0))


def box_points(count=4000, seed=1):
    return np.random.default_rng(seed).uniform(-1, 1, (count, 3))


def merged(*meshes):
    mesh = trimesh.util.concatenate(list(meshes))
    return np.array(mesh.vertices), np.array(mesh.faces)


def sheet(size=12, height=0.1):
    """A wavy square sheet."""
    x, y = np.meshgrid(np.linspace(-1, 1, size), np.linspace(-1, 1, size), indexing="ij")
    vertices = np.stack([x, y, height * np.sin(3 * x) * np.cos(2 * y)], axis=-1).reshape(-1, 3)
    index = np.arange(size * size).reshape(size, size)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    return vertices, np.concatenate(triangles)


# Cleaning


def test_cleaning_scales_the_longest_side_to_1_7_and_tells_the_way_back():
    vertices = SPHERE.vertices * [3, 1, 2] + [50, -20, 7]
    mesh = clean(vertices, SPHERE.faces)
    assert np.ptp(mesh.vertices, axis=0).max() == pytest.approx(1.7)
    back = mesh.scale * mesh.vertices + mesh.center
    assert trimesh.Trimesh(back, mesh.triangles).bounds == pytest.approx(
        np.array([vertices.min(axis=0), vertices.max(axis=0)]), abs=1e-4
    )


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), scale=st.sampled_from([1e-4, 1.0, 1e6]))
def test_a_soup_of_flipped_doubled_and_collapsed_faces_becomes_a_watertight_mesh(seed, scale):
    rng = np.random.default_rng(seed)
    soup = SPHERE.vertices[SPHERE.faces].reshape(-1, 3) * scale
    faces = np.arange(len(soup)).reshape(-1, 3)
    flipped = rng.random(len(faces)) < 0.4
    faces[flipped] = faces[flipped, ::-1]
    doubled = faces[rng.integers(0, len(faces), 50)][:, [1, 0, 2]]
    collapsed = faces[:20, [0, 0, 1]]
    faces = rng.permutation(np.concatenate([faces, doubled, collapsed]))
    result = clean(soup, faces)
    mesh = trimesh.Trimesh(result.vertices, result.triangles, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(SPHERE.volume * 0.85**3, rel=1e-3)
    assert result.repairs["collapsed"] == 20
    assert len(result.triangles) == len(SPHERE.faces)


def test_every_piece_is_turned_outward():
    vertices, faces = merged(
        SPHERE.copy().apply_translation([3, 0, 0]), SPHERE.copy().apply_translation([-3, 0, 0])
    )
    faces[: len(SPHERE.faces)] = faces[: len(SPHERE.faces), ::-1]
    mesh = clean(vertices, faces)
    volumes = [part.volume for part in trimesh.Trimesh(mesh.vertices, mesh.triangles).split()]
    assert len(volumes) == 2 and min(volumes) > 0
    assert mesh.repairs["flipped"] == len(SPHERE.faces)


def test_more_faces_than_a_field_can_hold_are_merged(monkeypatch):
    monkeypatch.setattr(mesh_cleanup, "MOST_FACES", 2000)
    mesh = clean(SPHERE.vertices, SPHERE.faces)
    assert 500 < len(mesh.triangles) <= 2000
    gone = sum(mesh.repairs[name] for name in ("decimated", "collapsed", "doubled"))
    assert gone == len(SPHERE.faces) - len(mesh.triangles)
    assert mesh.repairs["decimated"] > 3000
    ball = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert ball.volume == pytest.approx(SPHERE.volume * 0.85**3, rel=0.03)
    (note,) = prepare(mesh, Open.SOLID).notes
    assert note.endswith(f" fewer, {len(mesh.triangles)} left.")
    x = box_points()
    value = MeshDistance(mesh, np.random.default_rng(0))(x).value
    assert value == pytest.approx(np.linalg.norm(x, axis=1) - 0.85, abs=0.02)


def test_merging_folds_flaps_and_leaves_no_openings(monkeypatch):
    """Rough as a scan, so that the vertices of some cells are a fold's both sides."""
    monkeypatch.setattr(mesh_cleanup, "MOST_FACES", 2000)
    monkeypatch.setattr(mesh_cleanup, "CLUSTERS", 40)
    random = np.random.default_rng(0)
    mesh = clean(SPHERE.vertices + 0.05 * random.normal(size=SPHERE.vertices.shape), SPHERE.faces)
    assert mesh.repairs["decimated"] > 1000
    assert openings(mesh).number == 0


def test_an_open_piece_keeps_the_side_of_its_majority():
    vertices, faces = sheet()
    faces[3] = faces[3, ::-1]
    mesh = clean(vertices, faces)
    assert mesh.repairs["flipped"] == 1


NAN = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, np.nan]])


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int), "no faces"),
        (np.eye(3), np.zeros((0, 3), int), "no faces"),
        (np.eye(3), [[0, 1, 3]], "damaged"),
        (np.eye(3), [[0, 1, -1]], "damaged"),
        (np.eye(3), [[0, 1, 2, 2]], "Triangulate"),
        (NAN, [[0, 1, 2], [0, 1, 3]], "finite position"),
        (np.ones((3, 3)), [[0, 1, 2]], "no extent"),
        (np.array([[0, 0, 0], [1, 0, 0], [2.0, 0, 0]]), [[0, 1, 2]], "zero area"),
        (SPHERE.vertices * 1e35, SPHERE.faces, "sensible size"),
        ((SPHERE.vertices + 1e6).astype(np.float32), SPHERE.faces, "far from its origin"),
        (BOX.vertices * (1, 1, 0), BOX.faces, "flat"),  # its faces lie upon each other in pairs
        (SPHERE.vertices @ TURN * (1, 1, 1e-7) @ TURN.T, SPHERE.faces, "flat"),
        (*sheet(), "open sheet"),
        (*sheet(height=0), "open sheet"),
        (np.eye(3), [[0, 1, 2]], "open sheet"),
        (*merged(SPHERE, trimesh.Trimesh(*sheet(size=20)).apply_scale(3)), "open sheet"),
        (*merged(SPHERE, trimesh.Trimesh(*sheet()).apply_translation([0, 0, 1.5])), "A part of"),
    ],
)
def test_what_cannot_be_fitted_says_why(vertices, triangles, message):
    with pytest.raises(SculptError, match=message):
        fit_mesh(vertices, triangles, preset="draft")


def test_vertices_that_no_face_uses_may_be_anything():
    mesh = clean(NAN, [[0, 1, 2]])
    assert len(mesh.vertices) == 3


# Distance


def test_distance_of_a_sphere_is_the_closed_form():
    x = box_points()
    found = distance_to(
        trimesh.creation.icosphere(6).vertices, trimesh.creation.icosphere(6).faces
    )(x)
    radius = np.linalg.norm(x, axis=1)
    assert found.value == pytest.approx(radius - 0.85, abs=2e-4)
    assert np.abs(found.gradient - x / radius[:, None]).max() < 0.05


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), flipped=st.booleans())
def test_distance_of_any_closed_mesh_is_that_of_libigl(seed, flipped):
    rng = np.random.default_rng(seed)
    radii = np.exp(0.25 * rng.standard_normal(len(COARSE.vertices)))[:, None]
    faces = COARSE.faces[:, ::-1] if flipped else COARSE.faces
    mesh = clean(radii * COARSE.vertices, faces)
    x = box_points(300, seed)
    found = MeshDistance(mesh, rng)(x)
    kind = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    signed, *_ = igl.signed_distance(x, mesh.vertices, mesh.triangles, kind)
    assert found.value == pytest.approx(signed, abs=1e-9)
    inside = igl.winding_number(mesh.vertices, mesh.triangles, x) > 0.5
    assert np.array_equal(inside, found.value < 0)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), thickness=st.floats(0.02, 0.5))
def test_any_patch_becomes_a_closed_shell_of_its_thickness(seed, thickness):
    rng = np.random.default_rng(seed)
    toward = rng.standard_normal(3)
    patch = SPHERE.faces[SPHERE.triangles_center @ (toward / np.linalg.norm(toward)) > 0.6]
    area = trimesh.Trimesh(SPHERE.vertices, patch).area
    mesh = clean(SPHERE.vertices, rng.permutation(patch))
    thick = thicken(mesh, thickness / mesh.scale)
    shell = trimesh.Trimesh(thick.vertices, thick.triangles, process=False)
    shell.remove_unreferenced_vertices()
    assert shell.is_watertight
    assert shell.is_winding_consistent
    exact = area * thickness * (1 + thickness**2 / 12)  # between two spheres
    assert shell.volume * thick.scale**3 == pytest.approx(exact, rel=0.02)


def test_distance_of_a_box_is_the_closed_form():
    x = box_points()
    found = distance_to(BOX.vertices, BOX.faces)(x)
    beyond = np.abs(x) - np.array([1.7, 1.2, 0.8]) / 2
    exact = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    assert found.value == pytest.approx(exact, abs=1e-9)
    step = 1e-6
    moved = distance_to(BOX.vertices, BOX.faces)(x + step * found.gradient)
    assert np.percentile((moved.value - found.value) / step, 1) == pytest.approx(1, abs=1e-4)


def test_inside_out_meshes_measure_the_same():
    x = box_points()
    there = distance_to(SPHERE.vertices, SPHERE.faces)(x)
    back = distance_to(SPHERE.vertices, SPHERE.faces[:, ::-1])(x)
    assert np.array_equal(there.value, back.value)


@pytest.mark.parametrize("share", [0.05, 0.4])
def test_missing_faces_leave_the_sign_right(share):
    keep = np.random.default_rng(3).random(len(SPHERE.faces)) > share
    x = box_points()
    found = distance_to(SPHERE.vertices, SPHERE.faces[keep])(x)
    exact = np.linalg.norm(x, axis=1) - 0.85
    clear = np.abs(exact) > 0.05
    assert np.mean((found.value < 0) == (exact < 0), where=clear) > 0.999


def test_across_a_large_hole_the_distance_changes_sign_without_a_jump():
    open_sphere = SPHERE.faces[SPHERE.triangles_center[:, 2] < 0.8]
    distance = distance_to(SPHERE.vertices, open_sphere)
    line = np.zeros((2001, 3))
    line[:, 2] = np.linspace(-0.5, 1.2, 2001)
    value = distance(line).value
    assert value[0] < 0 < value[-1]
    assert np.abs(np.diff(value)).max() < 0.02


def test_pieces_stuck_into_each_other_become_one_outer_surface():
    other = SPHERE.copy().apply_translation([0.7, 0, 0])
    distance = distance_to(*merged(SPHERE, other))
    scale = 1.7 / 2.7
    x = box_points()
    centers = np.array([[-0.35, 0, 0], [0.35, 0, 0]]) * scale
    each = np.linalg.norm(x[:, None] - centers, axis=2) - scale
    seam = np.stack([x[:, 0], np.hypot(x[:, 1], x[:, 2]) - np.sqrt(1 - 0.35**2) * scale], axis=1)
    inside = each.min(axis=1) < 0
    value = distance(x).value
    assert np.mean((value < 0) == inside) > 0.999
    assert value[~inside] == pytest.approx(each.min(axis=1)[~inside], abs=3e-3)
    # No trace of the walls inside: on the plane between the spheres the surface is the seam.
    middle = inside & (np.abs(x[:, 0]) < 0.02)
    assert -value[middle] == pytest.approx(np.linalg.norm(seam[middle], axis=1), abs=0.03)


def test_an_inner_wall_is_no_surface():
    wall = trimesh.Trimesh([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], [[0, 1, 2], [0, 2, 3]])
    cube = trimesh.creation.box((2, 2, 2))
    distance = distance_to(*merged(cube, wall))
    assert distance(np.array([[0.01, 0.1, 0.0]])).value == pytest.approx(-0.75, abs=0.02)


def test_a_flat_sheet_with_a_thickness_is_a_slab():
    thick = thicken(clean(*sheet(height=0)), 0.2)
    slab = trimesh.Trimesh(thick.vertices * thick.scale + thick.center, thick.triangles)
    assert slab.is_watertight
    assert slab.is_winding_consistent
    assert slab.volume == pytest.approx(2 * 2 * 0.2 * 2 / 1.7)
    assert np.ptp(thick.vertices, axis=0).max() == pytest.approx(1.7)
    points = np.array([[0, 0, 0.05], [0, 0, 0.3], [0.1, 0.1, -0.3]])
    value = MeshDistance(thick, np.random.default_rng(0))(points).value
    assert value == pytest.approx([-0.05, 0.2, 0.2], abs=1e-9)


def test_a_thickness_leaves_closed_pieces_as_they_are():
    roof = trimesh.Trimesh(*sheet(height=0)).apply_translation([0, 0, 3])
    mesh = clean(*merged(SPHERE, roof))
    thick = thicken(mesh, 0.1)
    parts = trimesh.Trimesh(thick.vertices, thick.triangles, process=False).split()
    ball, slab = sorted(parts, key=lambda part: -len(part.faces))
    assert ball.volume * (thick.scale / mesh.scale) ** 3 * mesh.scale**3 == pytest.approx(
        SPHERE.volume, rel=1e-3
    )
    assert slab.is_watertight
    assert slab.volume == pytest.approx(4 * 0.1 * mesh.scale / thick.scale**3, rel=1e-6)
    assert thicken(clean(SPHERE.vertices, SPHERE.faces), 0.1).repairs.get("thickened") is None


def test_surface_samples_are_uniform_by_area():
    surface = distance_to(BOX.vertices, BOX.faces).surface(20000, np.random.default_rng(0))
    on_top = np.isclose(surface.points[:, 2], 0.4)
    areas = np.array([1.7 * 1.2, 1.2 * 0.8, 1.7 * 0.8])
    assert on_top.mean() == pytest.approx(areas[0] / areas.sum() / 2, abs=0.01)
    assert np.allclose(surface.normals[on_top], [0, 0, 1])


# Learning


@pytest.mark.parametrize("close", [0, 25, 40])
@pytest.mark.parametrize("widths", [(9,), (8, 7), (6, 5, 7)])
def test_written_out_derivatives_equal_autograd(widths, close):
    generator = torch.Generator().manual_seed(0)
    network = Siren.random(widths, 5.0, generator)
    network = network.with_parameters([p.double() for p in network.parameters])
    points = 2 * torch.rand(40, 3, generator=generator, dtype=torch.float64) - 1
    gradients = torch.randn(40, 3, generator=generator, dtype=torch.float64)
    gradients = gradients[:close]
    batch = TrainingSamples(points, 0.3 * points[:, 0], gradients)
    _, slopes = loss_gradients(network, batch)

    parameters = [p.clone().requires_grad_() for p in network.parameters]
    f, gradient = network.with_parameters(parameters).value_and_gradient(points)
    weight = 1 / (batch.values.abs() + SOFTNESS)
    off = (gradient[:close] - gradients).square().sum(dim=1)
    loss = (weight * (f - batch.values).square()).mean()
    loss = loss + GRADIENT_WEIGHT * off.sum() / max(close, 1)
    for mine, theirs in zip(slopes, torch.autograd.grad(loss, parameters), strict=True):
        assert torch.allclose(mine, theirs, rtol=1e-9, atol=1e-12)


def test_adam_takes_the_steps_of_torch():
    generator = torch.Generator().manual_seed(0)
    mine = [torch.randn(5, 3, generator=generator), torch.randn(7, generator=generator)]
    theirs = [tensor.clone() for tensor in mine]
    adam, oracle = Adam(mine, (0.95, 0.99)), torch.optim.Adam(theirs, betas=(0.95, 0.99))
    for rate in (1e-2, 3e-3, 1e-3):
        gradients = [torch.randn(tensor.shape, generator=generator) for tensor in mine]
        adam.step(gradients, rate)
        oracle.param_groups[0]["lr"] = rate
        for tensor, gradient in zip(theirs, gradients, strict=True):
            tensor.grad = gradient
        oracle.step()
    assert all(torch.allclose(a, b, atol=1e-7) for a, b in zip(mine, theirs, strict=True))


def test_the_papers_loss_has_its_published_weights():
    on, off = torch.tensor([0.1, -0.1]), torch.tensor([0.0, 0.5])
    gradient = torch.tensor([[2.0, 0, 0], [0, 0.5, 0]])
    normals = torch.tensor([[1.0, 0, 0], [1.0, 0, 0]])
    expected = 1500 * 0.1 + 2.5 * 0.5 + 5 * 0.75 + 5 * (1 + np.exp(-50)) / 2
    assert float(paper_loss(on, gradient, normals, off, gradient)) == pytest.approx(expected)


def same(one, other):
    """Whether two fields have the same bits."""
    pairs = list(zip(one.network.parameters, other.network.parameters, strict=True))
    details = one.detail.coefficients, other.detail.coefficients
    return (
        all(torch.equal(a, b) for a, b in pairs)
        and details[0].keys() == details[1].keys()
        and all(
            np.array_equal(details[0][k].index, details[1][k].index)
            and np.array_equal(details[0][k].values, details[1][k].values)
            for k in details[0]
        )
    )


@pytest.fixture(scope="module")
def sphere_fit():
    return fit_mesh(SPHERE.vertices * 10 + 5, SPHERE.faces, preset="draft")


def test_a_sphere_is_fitted_and_reported(sphere_fit):
    assert sphere_fit.scale == pytest.approx(20 / 1.7, rel=1e-3)
    assert sphere_fit.center == pytest.approx((5, 5, 5), abs=1e-3)
    report = sphere_fit.report
    assert report["error_mean"] < 5e-4
    assert report["error_mean"] <= report["error_p95"] <= report["error_max"]
    assert report["normal_deg"] < 2.5
    assert report["sign_errors"] == 0
    assert report["components"] == 1
    json.dumps(report, allow_nan=False)
    x = box_points()
    exact = np.linalg.norm(x, axis=1) - 0.85
    assert np.abs(values(sphere_fit.field, x) - exact).mean() < 0.03


@pytest.mark.parametrize("number", [1, 4])
def test_the_same_seed_gives_the_same_bits_whatever_the_cores(sphere_fit, cores, number):
    cores(number)
    again = fit_mesh(SPHERE.vertices * 10 + 5, SPHERE.faces, preset="draft")
    assert same(again.field, sphere_fit.field)


@pytest.mark.long
def test_another_seed_gives_another_field(sphere_fit):
    other = fit_mesh(SPHERE.vertices * 10 + 5, SPHERE.faces, preset="draft", seed=1)
    assert not same(other.field, sphere_fit.field)


@pytest.mark.long
def test_finer_levels_come_closer_to_a_torus():
    """Against the closed form, of which the mesh is a fine tessellation."""
    mesh = trimesh.creation.torus(0.5, 0.2, major_sections=288, minor_sections=144)
    turn, round_ = 2 * np.pi * np.random.default_rng(3).random((2, 4000))
    out = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    normal = np.cos(round_)[:, None] * out + np.sin(round_)[:, None] * [0, 0, 1]
    x = 0.5 * out + 0.2 * normal
    errors, angles = [], []
    for preset in ("draft", "normal"):
        fit = fit_mesh(mesh.vertices, mesh.faces, preset=preset)
        found = find_surface(fit.field, (x - fit.center) / fit.scale)
        errors.append(found.distance.mean() * fit.scale)
        cosine = np.clip((found.normals * normal).sum(axis=1), -1, 1)
        angles.append(np.degrees(np.arccos(cosine)).mean())
        assert fit.report["sign_errors"] == 0
        assert fit.report["components"] == 1
    assert errors[1] < 1e-4 and errors[1] < errors[0]
    assert angles[1] < 1.5 and angles[1] < angles[0]


def test_a_box_has_sharp_creases_and_no_crumbs():
    fit = fit_mesh(BOX.vertices, BOX.faces)
    assert fit.report["error_mean"] < 2e-4
    assert fit.report["normal_deg"] < 2
    assert fit.report["components"] == 1
    points = box_points(40_000)
    beyond = np.abs(points) - np.array([1.7, 1.2, 0.8]) / 2
    exact = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    clear = np.abs(exact) > 5e-3
    assert np.array_equal((values(fit.field, points) < 0)[clear], (exact < 0)[clear])
    levels = fit.field.detail.coefficients
    flat = sum(len(part.index) for level, part in levels.items() if level <= 6)
    assert flat < 48_000  # where a ball of this size has twice as many: its creases alone are fine


def test_creases_get_one_level_more_than_the_preset_and_flat_faces_do_not():
    detail = fit_mesh(BOX.vertices, BOX.faces, preset="draft").field.detail.coefficients
    finest = TOLERANCES["draft"].finest
    assert max(detail) == finest + 1
    nodes = centres(places(detail[finest + 1].index, finest + 1), finest + 1)
    off = np.sort(np.abs(np.abs(nodes) - np.array([1.7, 1.2, 0.8]) / 2), axis=1)
    assert off[:, 1].max() < 4 * spacing(finest + 1)  # two of three faces are near: an edge


@pytest.mark.long
def test_a_thin_plate_is_one_piece():
    plate = trimesh.creation.box((1.7, 1.2, 0.04))
    report = fit_mesh(plate.vertices, plate.faces).report
    assert report["error_mean"] < 2e-4
    assert report["sign_errors"] == 0
    assert report["components"] == 1


def test_flipped_faces_do_not_turn_the_surface_over():
    flipped = TORUS.faces.copy()
    some = np.random.default_rng(0).random(len(flipped)) < 0.1
    flipped[some] = flipped[some, ::-1]
    report = fit_mesh(TORUS.vertices, flipped, preset="draft").report
    assert report["error_mean"] < 1e-3
    assert report["sign_errors"] == 0
    assert report["components"] == 1


def test_a_sheet_with_thickness_is_fitted():
    fit = fit_mesh(*sheet(), preset="draft", thickness=0.3)
    assert fit.report["error_mean"] < 2e-3
    assert fit.report["components"] == 1


def test_good_enough_keeps_what_is_there_and_a_preview_shows_it(monkeypatch):
    monkeypatch.setattr(schedule, "PREVIEW_SECONDS", 0.0)
    shown, steps = [], []

    def watch(fraction, text):
        steps.append(text)

    fit = fit_mesh(
        BOX.vertices,
        BOX.faces,
        progress=watch,
        preview=shown.append,
        enough=lambda: len(shown) >= 150,
    )
    assert len(shown) == 150
    assert sum(text.startswith("Fitting, error") for text in steps) == 150
    assert shown[-1].report["error"] < shown[0].report["error"]
    assert (shown[0].scale, shown[0].center) == (fit.scale, fit.center)
    points, _, _ = distance_to(BOX.vertices, BOX.faces).surface(2000, np.random.default_rng(0))
    fields = shown[0].field, shown[-1].field
    first, last = (find_surface(field, points).distance.mean() for field in fields)
    assert last < first / 3
    assert not fit.field.detail.levels
    assert fit.report["error_mean"] < 0.01


@pytest.mark.parametrize("width", [64, pytest.param(256, marks=pytest.mark.long)])
def test_the_width_is_a_choice(width):
    fit = fit_mesh(SPHERE.vertices, SPHERE.faces, preset="draft", width=width)
    assert fit.field.network.widths == (width, width)
    assert fit.report["error_mean"] < 5e-4


def test_without_detail_there_is_a_network_alone():
    fit = fit_mesh(SPHERE.vertices, SPHERE.faces, preset="draft", detail=False)
    assert not fit.field.detail.levels
    assert fit.report["error_mean"] < 3e-3


@pytest.mark.parametrize("given", [{"preset": "best"}, {"seed": -1}, {"seed": 10**40}])
def test_no_such_quality_or_seed(given):
    with pytest.raises(SculptError, match=r"quality|seed"):
        fit_mesh(SPHERE.vertices, SPHERE.faces, **given)


def test_no_other_width():
    with pytest.raises(SculptError, match="units wide"):
        fit_mesh(SPHERE.vertices, SPHERE.faces, width=100)


def test_the_papers_fit_finds_the_surface():
    fit = fit_mesh(SPHERE.vertices, SPHERE.faces, method="paper", preset="draft")
    assert fit.field.network.omegas == (30.0, 30.0)
    assert not fit.field.detail.levels
    assert fit.report["error_mean"] < 0.02


def test_progress_tells_the_error_and_cancels():
    seen = []

    def watch(fraction, text):
        seen.append((fraction, text))
        if fraction > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        fit_mesh(BOX.vertices, BOX.faces, preset="draft", progress=watch)
    fractions = [fraction for fraction, _ in seen]
    assert fractions == sorted(fractions)
    assert any("error 0." in text for _, text in seen)


def test_the_origin_is_kept_where_the_shape_stays_nearly_as_large() -> None:
    """A sphere of radius 1 whose middle is 0.2 beside its origin in X and 0.5 below it in Z."""
    vertices = SPHERE.vertices / np.linalg.norm(SPHERE.vertices, axis=1).max() + (0.2, 0, -0.5)
    plain = clean(vertices, SPHERE.faces)
    np.testing.assert_allclose(plain.center, (0.2, 0, -0.5), atol=0.01)
    kept = clean(vertices, SPHERE.faces, keep_origin=True)
    np.testing.assert_allclose(kept.center, (0, 0, -0.5), atol=0.01)
    assert kept.center[0] == 0
    assert kept.scale == pytest.approx(1.2 / 0.85, rel=0.01)  # its farthest point is 1.2 away
    np.testing.assert_allclose(np.ptp(kept.vertices, axis=0) * kept.scale, 2, atol=0.02)
    assert np.abs(kept.vertices).max() == pytest.approx(0.85)


def test_a_sheet_that_gets_thick_keeps_the_origin_too() -> None:
    vertices, triangles = sheet(height=0)
    vertices = np.add(vertices, (0.2, 0, 0))
    thick = thicken(clean(vertices, triangles, keep_origin=True), 0.2)
    assert thick.center[0] == pytest.approx(0, abs=1e-12)
