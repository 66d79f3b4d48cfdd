# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a mesh a field lacks is told, and surface where the mesh has none is taken away.

Fields are fitted to one mesh and judged by another one, so what is missing is known.
"""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.fit.fit import TOLERANCES, Quality, fit_mesh
from neural_sculpt_addon.field.fit.fit_repair import Repaired, repaired
from neural_sculpt_addon.field.fit.fit_report import Presets, report
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance
from neural_sculpt_addon.field.fit.strays import find_hidden, find_strays, find_tiny
from neural_sculpt_addon.field.levels import (
    Level,
    cells_of,
    centres,
    dilated,
    distinct,
    linear,
    places,
    quantised,
)
from neural_sculpt_addon.field.mesh.proxy import extract

CELLS = 128
BALL = trimesh.creation.icosphere(5, 0.6)
PILLS = [trimesh.creation.icosphere(3, 0.1).apply_translation([x, 0, 0]) for x in (-0.75, 0.75)]


def merged(*meshes):
    mesh = trimesh.util.concatenate(list(meshes))
    return np.array(mesh.vertices), np.array(mesh.faces)


@pytest.fixture(scope="module")
def three():
    """A ball of radius 0.6 between two of 0.1, in model space as they are."""
    return fit_mesh(*merged(BALL, *PILLS), preset="draft")


def judged(field, vertices, faces, preset=Quality.DRAFT):
    mesh = clean(vertices, faces)
    distance = MeshDistance(mesh, np.random.default_rng(0))
    presets = Presets(TOLERANCES, preset)
    rng = np.random.default_rng(1)
    proxy = extract(field, CELLS)
    found = Repaired(field, proxy, find_strays(proxy, distance))
    return report(found, mesh, distance, presets, rng)


def test_a_field_that_has_all_has_nothing_to_say(three):
    found = three.report
    assert "notes" not in found
    assert (found["components"], found["mesh_components"], found["lost"]) == (3, 3, 0)
    assert found["thin"] == 0
    assert found["beyond"] < 0.01
    assert found["allowed"] == 1e-3


def test_a_lost_piece_is_told_and_shown(three):
    small = trimesh.creation.icosphere(3, 0.05)
    small = [small.copy().apply_translation([0, y, 0]) for y in (-0.75, 0.75)]
    measures, notes = judged(three.field, *merged(BALL, *small, *PILLS))
    assert (measures["components"], measures["mesh_components"]) == (3, 5)
    assert measures["lost"] == 2
    assert notes[0].startswith("The mesh has 5 pieces, the field 3.")
    assert notes[1] == "Pieces of the mesh that the field lacks: 2. Quality Normal would do."
    worst = np.abs(measures["worst"][:2])
    assert np.linalg.norm(worst - [0, 0.75, 0], axis=1) == pytest.approx(0.05, abs=1e-3)
    assert {place[1] > 0 for place in measures["worst"][:2]} == {True, False}
    assert measures["error_max"] == pytest.approx(0.8 - 0.6, abs=0.01)


def test_pieces_that_pass_between_the_points_of_the_lattice_are_counted(three):
    """Single splines of level 9 far off, between the points of a lattice of 128 cells: outside of
    the balls and, as a hollow, in the large one."""
    center = np.array([[0.2, 0.3, 0.8], [0.1, 0.1, 0.1]]) // (1 / 64) / 64 + 1 / 128
    nodes = linear(cells_of(center - 1e-4, 9), 9)
    order = np.argsort(nodes)
    field = three.field.plus({9: Level(nodes[order], quantised(np.array([-1.5, 1.8])[order]))})
    measures, notes = judged(field, *merged(BALL, *PILLS))
    assert extract(field, CELLS).components.total == 3
    assert (measures["tiny"], measures["components"], measures["cavities"]) == (2, 5, 1)
    assert "Pieces of the field so small that a proxy may not show them: 2." in notes


def test_a_missing_cavity_is_told(three):
    inner = trimesh.creation.icosphere(4, 0.3)
    inner.invert()
    measures, notes = judged(three.field, *merged(BALL, inner, *PILLS))
    assert (measures["cavities"], measures["mesh_cavities"]) == (0, 1)
    assert measures["lost"] == 1
    assert any(note.startswith("The mesh has 1 cavities, the field 0.") for note in notes)


@pytest.mark.parametrize(("preset", "thin"), [("draft", 1), ("normal", 1), ("fine", 0)])
def test_rods_thinner_than_a_cell_are_measured(three, preset, thin):
    width = 0.012  # cells of the presets: 1/32, 1/64, 1/128
    rods = [
        trimesh.creation.box((1.7, width, width)).apply_translation([0, 0.3 * i, 0])
        for i in range(3)
    ]
    measures, notes = judged(three.field, *merged(*rods), preset)
    assert measures["thin"] == pytest.approx(thin, abs=0.02)
    assert measures["mesh_components"] == 3
    told = [note for note in notes if note.startswith("Parts or gaps thinner")]
    assert len(told) == thin
    assert all("Quality Fine would do." in note for note in told)


@pytest.mark.long
def test_thin_rods_are_fitted_with_a_word_that_names_the_preset():
    rods = [
        trimesh.creation.box((1.7, 0.015, 0.015)).apply_translation([0, 0.1 * i, 0])
        for i in range(7)
    ]
    found = fit_mesh(*merged(*rods), preset="draft").report
    assert found["mesh_components"] == 7
    assert found["notes"][-1].startswith("Parts or gaps thinner than 0.031 are off:")
    assert found["notes"][-1].endswith("Quality Fine would do.")


BUMPS = {
    "void": ((0, 0, 0), 3, 2.0, 0.2),
    "large void": ((0.05, 0, 0), 2, 2.0, 0.45),
    "island": ((0, 0.75, 0.1), 4, -1.0, 0.1),
}
"""Where, and level, height and reach of the spline that makes it."""


@pytest.mark.parametrize(("center", "level", "height", "reach"), BUMPS.values(), ids=BUMPS)
def test_strays_are_taken_away_and_all_else_stays(three, center, level, height, reach):
    """One spline makes a void in the ball, or an island beside it."""
    node = distinct(cells_of(np.array([center], float), level), level)
    spoiled = three.field.plus({level: Level(node, quantised(np.array([height])))})
    distance = MeshDistance(clean(*merged(BALL, *PILLS)), np.random.default_rng(0))
    proxy = extract(spoiled, CELLS)
    assert proxy.components.total == 4
    strays = find_strays(proxy, distance)
    assert len(strays.points) > 10
    assert np.abs(strays.points - center).max() < reach
    found = repaired(spoiled, distance, CELLS, np.random.default_rng(0))
    assert not len(found.left.points)
    assert found.proxy.components.total == 3
    assert extract(found.field, 256).components.total == 3
    surface = distance.surface(4000, np.random.default_rng(2)).points
    good, given, now = (
        np.abs(values(field, surface)).mean() for field in (three.field, spoiled, found.field)
    )
    assert now < max(given, good + 1e-4)  # a tenth of what the preset allows


@pytest.mark.long
def test_an_island_over_a_film_is_taken_away_and_the_film_stays():
    """A ball without its top is closed by a film, over which 27 splines make an island: a piece
    by itself, which the mesh has none of."""
    vertices, faces = merged(BALL)
    faces = faces[vertices[faces].mean(axis=1)[:, 2] < 0.2]
    fit = fit_mesh(vertices, faces, preset="draft")
    distance = MeshDistance(clean(vertices, faces), np.random.default_rng(0))
    rim = distance.vertices[distance.faces[: distance.of_mesh]][..., 2].max()
    center = np.array([0, 0, rim + 0.3])
    nodes = dilated(distinct(cells_of(center[None], 5), 5), 5)
    spoiled = fit.field.plus({5: Level(nodes, quantised(np.full(len(nodes), -1.0)))})
    assert extract(spoiled, CELLS).components.total == 2
    found = repaired(spoiled, distance, CELLS, np.random.default_rng(0))
    assert (len(found.left.points), found.proxy.components.total) == (0, 1)
    before, now = (extract(field, CELLS).vertices for field in (fit.field, found.field))
    assert now.max(axis=0) == pytest.approx(before.max(axis=0), abs=0.01)


def test_a_piece_that_is_off_all_over_is_a_stray_however_near_the_mesh_is(three):
    """Balls of radius 0.094 that touch those of 0.1 from inside: 0.006 off on average."""
    smaller = trimesh.creation.icosphere(3, 0.094)
    smaller = [smaller.copy().apply_translation([x, 0, 0]) for x in (-0.756, 0.756)]
    distance = MeshDistance(clean(*merged(BALL, *smaller)), np.random.default_rng(0))
    strays = find_strays(extract(three.field, CELLS), distance)
    assert len(strays.points) > 100
    assert np.abs(strays.points[:, 0]).min() > 0.64
    assert strays.away.max() < 0.014 < 2 / CELLS
    assert strays.away.mean() == pytest.approx(0.006, abs=5e-4)


def test_a_piece_that_does_not_face_as_the_mesh_does_is_a_stray(three):
    """Thin slabs, one upon another, where the field has the small balls: a slab is within a
    fifth of a cell of every vertex, but few face its way."""
    slabs = [
        trimesh.creation.box((0.25, 0.25, 0.0045)).apply_translation([x, 0, z])
        for x in (-0.725, 0.725)
        for z in np.arange(-0.11, 0.111, 0.01)
    ]
    distance = MeshDistance(clean(*merged(BALL, *slabs)), np.random.default_rng(0))
    strays = find_strays(extract(three.field, CELLS), distance)
    assert len(strays.points) > 100
    assert np.abs(strays.points[:, 0]).min() > 0.64
    assert strays.away.mean() < 0.25 * 2 / CELLS


def test_a_tiny_hollow_beside_a_thin_gap_of_the_mesh_is_a_stray(three):
    """A spline of level 9 makes it, between the points of a lattice of 128 cells; the mesh has a
    gap 0.4 cells away, which the field lacks, so the hollow is not part of that."""
    center = np.array([[0.1, 0.1, 0.1]]) // (1 / 64) / 64 + 1 / 128
    node = linear(cells_of(center - 1e-4, 9), 9)
    field = three.field.plus({9: Level(node, quantised(np.array([1.8])))})
    proxy = extract(field, CELLS)
    gap = trimesh.creation.box((0.3, 0.3, 0.003))
    gap.apply_translation(center[0] + [0, 0, 0.4 * 2 / CELLS + 0.003 / 2])
    gap.invert()
    distance = MeshDistance(clean(*merged(BALL, gap, *PILLS)), np.random.default_rng(0))
    assert not len(find_strays(proxy, distance).points)
    found = find_tiny(field, proxy, distance)
    assert len(found.points)
    assert np.linalg.norm(found.points - center, axis=1).max() < 2 / 256
    assert found.away == pytest.approx(0.4 * 2 / CELLS, abs=2 / 512)


def test_surface_in_openings_without_a_film_is_no_stray(three):
    """Holes in the ball so small that they get none, and so large that their middle is more than a
    cell of the proxy from the mesh. A void in the ball is one there, too."""
    middles = trimesh.sample.sample_surface_even(BALL, 40, seed=0)[0]
    away = np.linalg.norm(BALL.triangles_center[:, None] - middles, axis=2).min(axis=1)
    holed = trimesh.Trimesh(BALL.vertices, BALL.faces[away > 0.021], process=False)
    distance = MeshDistance(clean(*merged(holed, *PILLS)), np.random.default_rng(0))
    proxy = extract(three.field, CELLS)
    assert distance.away(proxy.vertices.astype(float)).max() > 1.1 * proxy.active.spacing
    assert not len(find_strays(proxy, distance).points)
    rng = np.random.default_rng(0)
    assert not len(find_hidden(three.field, proxy, distance, rng, None).points)
    node = distinct(cells_of(np.zeros((1, 3)), 3), 3)
    spoiled = three.field.plus({3: Level(node, quantised(np.array([2.0])))})
    strays = find_strays(extract(spoiled, CELLS), distance).points
    assert len(strays) and np.linalg.norm(strays, axis=1).max() < 0.25


def test_without_detail_strays_are_only_counted(three):
    node = distinct(cells_of(np.zeros((1, 3)), 3), 3)
    spoiled = three.field.plus({3: Level(node, quantised(np.array([2.0])))})
    distance = MeshDistance(clean(*merged(BALL, *PILLS)), np.random.default_rng(0))
    found = repaired(spoiled, distance, CELLS, np.random.default_rng(0), may_add=False)
    assert len(found.left.points) > 50
    assert found.field is spoiled


def test_surface_where_the_mesh_has_none_is_one_of_the_worst_places(three):
    """A void of radius 0.1 in the middle of the ball, which is 0.5 to 0.6 from the mesh."""
    node = distinct(cells_of(np.zeros((1, 3)), 3), 3)
    spoiled = three.field.plus({3: Level(node, quantised(np.array([2.0])))})
    measures, _ = judged(spoiled, *merged(BALL, *PILLS))
    assert np.linalg.norm(measures["worst"][0]) < 0.2


@pytest.mark.long
def test_a_crumb_near_a_film_that_the_proxy_does_not_see_is_taken_away():
    """A ball without its top, and one spline over the film, in the middle of a cell of the proxy:
    it takes f below zero within 0.4 cells."""
    vertices, faces = merged(BALL)
    faces = faces[vertices[faces].mean(axis=1)[:, 2] < 0.2]
    fit = fit_mesh(vertices, faces, preset="draft")
    distance = MeshDistance(clean(vertices, faces), np.random.default_rng(0))
    node = distinct(cells_of(np.array([[0, 0, 0.75]]), 6), 6)
    center = centres(places(node, 6), 6)
    height = values(fit.field, center) / (0.75**3 - 0.75**2 * 0.4**2)
    spoiled = fit.field.plus({6: Level(node, quantised(-height))})
    assert values(spoiled, center)[0] < 0
    proxy = extract(spoiled, CELLS)
    assert proxy.components.total == 1
    assert not len(find_strays(proxy, distance).points)
    counted = repaired(spoiled, distance, CELLS, np.random.default_rng(0), may_add=False)
    away = np.linalg.norm(counted.left.points - center, axis=1)
    assert len(away) and away.max() < 0.6 * 2 / CELLS
    found = repaired(spoiled, distance, CELLS, np.random.default_rng(0))
    assert not len(found.left.points)
    assert values(found.field, center)[0] > 0


@pytest.mark.long
def test_a_crumb_in_the_middle_of_a_gap_is_taken_away():
    """Two slabs, 0.3 apart, and one spline between them: of the level whose cells are half as long
    as the crumb is far, no node lies two cells away from both."""
    slabs = [
        trimesh.creation.box((1.7, 0.4, 1)).apply_translation([0, y, 0]) for y in (-0.35, 0.35)
    ]
    fit = fit_mesh(*merged(*slabs), preset="draft")
    distance = MeshDistance(clean(*merged(*slabs)), np.random.default_rng(0))
    node = distinct(cells_of(np.array([[0.3, 0.001, 0.2]]), 6), 6)
    center = centres(places(node, 6), 6)
    spoiled = fit.field.plus({6: Level(node, quantised(-3 * values(fit.field, center)))})
    assert values(spoiled, center)[0] < 0
    found = repaired(spoiled, distance, CELLS, np.random.default_rng(0))
    assert not len(found.left.points)
    assert values(found.field, center)[0] > 0


@pytest.mark.long
def test_rods_beside_each_other_leave_no_islands():
    rods = [
        trimesh.creation.box((1.7, 0.06, 0.06)).apply_translation([0, 0.1 * i, 0]) for i in range(7)
    ]
    fit = fit_mesh(*merged(*rods), preset="normal")
    assert fit.report["components"] == fit.report["mesh_components"] == 7
    mesh = clean(*merged(*rods))
    off = MeshDistance(mesh, np.random.default_rng(0))(
        extract(fit.field, 200).vertices.astype(float)
    ).value
    assert np.abs(off).max() < 0.01
