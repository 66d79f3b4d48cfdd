# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit asks for: mirrored tubes, overlaps, and what must stay."""

from dataclasses import replace

import igl
import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.spatial import KDTree

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.levels import (
    Level,
    cells_of,
    centres,
    dilated,
    distinct,
    places,
    quantised,
)
from neural_sculpt_addon.field.mesh.surface import Samples
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import CELLS, SURFACE_SAMPLES, prepare
from neural_sculpt_addon.field.problem.tube import COLUMNS, ROWS, sample_tube
from neural_sculpt_addon.field.threads import PIECE
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Ends, Stroke
from tests.field.analytic import ball, ellipsoid, siren

SKEW = Profile(points=((-1, 0), (-0.5, 1), (0.5, -1), (1, 0)))


@pytest.fixture(scope="module")
def preparation():
    return prepare(ball(0.5))


def on_ball(longitudes, latitudes):
    a, b = np.broadcast_arrays(np.asarray(longitudes, float), latitudes)
    return 0.5 * np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=1)


def test_samples_of_the_surface_are_uniform_by_area(preparation):
    """On a sphere every coordinate is uniform (Archimedes)."""
    points, normals = preparation.surface
    assert len(points) == SURFACE_SAMPLES
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.5, atol=1e-4)
    np.testing.assert_allclose(normals, points / 0.5, atol=1e-3)
    even = np.linspace(-0.5, 0.5, SURFACE_SAMPLES)
    for coordinate in points.T:
        assert np.abs(np.sort(coordinate) - even).max() < 0.01


def test_values_off_the_surface_are_those_of_the_field(preparation):
    for points, known in (preparation.shell, preparation.box):
        expected = ((points.astype(float) ** 2).sum(axis=1) - 0.25) / 1.0
        np.testing.assert_allclose(known, expected, atol=3e-5)
    assert np.abs(preparation.box.points).max() <= 1
    away = np.abs(np.linalg.norm(preparation.shell.points, axis=1) - 0.5)
    assert away.mean() == pytest.approx(0.01 * (2 / np.pi) ** 0.5, rel=0.05)


def test_underestimation_is_the_ratio_of_the_distance_to_the_field(preparation):
    radius = np.linalg.norm(preparation.box.points.astype(float), axis=1)
    expected = np.abs(radius - 0.5) / (np.abs(radius**2 - 0.25) + 0.01)
    far = np.abs(radius - 0.5) > 0.05  # than which the samples are denser
    np.testing.assert_allclose(preparation.underestimation[far], expected[far], rtol=0.05)


def test_samples_are_drawn_once(preparation):
    assert preparation.proxy.active.cells == CELLS
    for name in ("surface", "shell", "box", "underestimation"):
        assert getattr(preparation, name) is getattr(preparation, name)


def test_the_same_seed_prepares_the_same(preparation):
    again = prepare(ball(0.5))
    np.testing.assert_array_equal(again.surface.points, preparation.surface.points)
    np.testing.assert_array_equal(again.box.points, preparation.box.points)


def test_preparation_can_be_cancelled():
    def progress(fraction, message):
        raise Cancelled

    with pytest.raises(Cancelled):
        prepare(ball(0.5), progress=progress)


def test_a_field_without_a_surface_cannot_be_prepared():
    with pytest.raises(SculptError, match="no surface"):
        prepare(Field(siren(([[0.1, 0, 0]], [0.0]), ([[0.1]], [1.0]))))


@pytest.mark.parametrize("axes", ["X", "XY", "XYZ"])
def test_mirrored_tubes_are_mirror_images(preparation, axes):
    points = on_ball(np.linspace(0.5, 1.0, 6), [0.5, 0.6, 0.7, 0.7, 0.6, 0.5])
    brush = Brush(0.1, 0.05, SKEW)
    tubes = pose(preparation, Stroke(points, brush, mirror=frozenset(axes))).tubes()
    assert len(tubes) == 2 ** len(axes)
    first = tubes[0].target
    for tube in tubes[1:]:
        signs = np.sign(tube.target.points.mean(axis=0)) * np.sign(first.points.mean(axis=0))
        assert abs(len(tube.target.points) - len(first.points)) < 0.01 * len(first.points)
        distance, index = KDTree(first.points).query(tube.target.points * signs)
        assert np.percentile(distance, 99) < 2e-5
        near = distance < 2e-5
        cosine = (first.normals[index] * tube.target.normals * signs).sum(axis=1)[near]
        assert np.percentile(cosine, 1) > 0.9999


def test_turned_tubes_are_turned_images(preparation):
    points = on_ball(np.linspace(0.5, 1.0, 6), [0.5, 0.6, 0.7, 0.7, 0.6, 0.5])
    stroke = Stroke(points, Brush(0.1, 0.05, SKEW), radial=(1, 1, 5))
    tubes = pose(preparation, stroke).tubes()
    assert len(tubes) == 5
    first = tubes[0].target
    for number, tube in enumerate(tubes):
        angle = 2 * np.pi * number / 5
        back = np.array(
            [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        )
        assert abs(len(tube.target.points) - len(first.points)) < 0.01 * len(first.points)
        distance, index = KDTree(first.points).query(tube.target.points @ back.T)
        assert np.percentile(distance, 99) < 2e-5
        near = distance < 2e-5
        cosine = (first.normals[index] * (tube.target.normals @ back.T)).sum(axis=1)[near]
        assert np.percentile(cosine, 1) > 0.9998


def test_a_dab_on_the_axis_is_one_copy(preparation):
    stroke = Stroke(np.array([[0, 0, 0.5]]), Brush(0.1, 0.05), radial=(1, 1, 8))
    assert len(pose(preparation, stroke).placed) == 1


def test_where_copies_overlap_the_larger_displacement_wins(preparation):
    """A stroke that crosses the plane x = 0, where it meets its mirror image."""
    points = on_ball(np.linspace(1.2, 1.8, 8), np.linspace(-0.1, 0.3, 8))
    stroke = Stroke(points, Brush(0.12, 0.05), mirror=frozenset("X"))
    problem = pose(preparation, stroke)
    tubes = problem.tubes()
    alone = pose(preparation, Stroke(points, stroke.brush)).tubes()[0]
    assert len(tubes[0].surface.points) < len(alone.surface.points)
    # By symmetry the largest displacement at x is the larger of those at (x, y, z) and (-x, y, z).
    flip = np.array([-1, 1, 1])
    for tube in tubes:
        amount = tube.displacement.amount
        heights = np.linalg.norm(tube.target.points, axis=1) - 0.5
        np.testing.assert_allclose(heights, amount, atol=2e-4)
        for tree_points in (tubes[0], tubes[1]):
            d, i = KDTree(tree_points.surface.points).query(tube.surface.points, workers=1)
            close = d < 0.002
            other = np.abs(tree_points.displacement.amount[i][close])
            assert (other - np.abs(amount[close])).max() < 0.004  # the slope times the distance
    mirrored = KDTree(tubes[1].surface.points).query(tubes[0].surface.points * flip)[0]
    assert np.percentile(mirrored, 99) < 1e-4


def test_the_untouched_surface_and_relative_distance(preparation):
    turn = np.linspace(0, 2 * np.pi, 25)[:-1]
    stroke = Stroke(on_ball(turn, 0), Brush(0.15, 0.05), closed=True)
    problem = pose(preparation, stroke)
    surface = preparation.surface
    latitude = np.arcsin(np.clip(surface.points[:, 2].astype(float) / 0.5, -1, 1))
    away = np.sin(np.abs(latitude) / 2) / 0.15
    near = problem.copies.relative_distance(surface)
    close = away < 2
    np.testing.assert_allclose(near[close], away[close], atol=2e-3)
    assert (near[~close] > 1.99).all()
    clear = np.abs(away - 1) > 2e-3
    np.testing.assert_array_equal(problem.copies.untouched(surface)[clear], (away > 1)[clear])
    np.testing.assert_allclose(
        problem.copies.distance(surface.points)[close], away[close], atol=2e-3
    )


def test_beyond_a_flat_end_the_surface_is_untouched(preparation):
    points = on_ball(np.linspace(0, 1, 8), 0)
    ends = {e: pose(preparation, Stroke(points, Brush(0.15, 0.05), ends=e)) for e in Ends}
    surface = preparation.surface
    past = (surface.points[:, 1] < -0.01) & (surface.points[:, 0] > 0)
    near = ends[Ends.ROUND].copies.relative_distance(surface) < 0.9
    assert not ends[Ends.ROUND].copies.untouched(surface)[past & near].any()
    assert ends[Ends.FLAT].copies.untouched(surface)[past & near].all()
    assert not ends[Ends.ROUND].known_untouched[past & near].any()
    assert ends[Ends.FLAT].known_untouched[past & near].all()
    assert (past & near).sum() > 100
    np.testing.assert_allclose(
        ends[Ends.FLAT].copies.relative_distance(surface)[near],
        ends[Ends.ROUND].copies.relative_distance(surface)[near],
    )


def test_the_rim_is_untouched(preparation):
    points = on_ball(np.linspace(1.2, 1.8, 8), 0.2)
    stroke = Stroke(points, Brush(0.12, 0.05), mirror=frozenset("XZ"))
    problem = pose(preparation, stroke)
    rim = problem.rim(2.2, 1000, np.random.default_rng(0))
    assert len(rim.points) > 300
    assert problem.copies.untouched(rim).all()
    assert problem.copies.relative_distance(rim).max() <= 2.2 + 1e-3


def on_path(problem, count):
    """Samples under the stroke."""
    _, path = problem.placed[0]
    return Samples(*(np.resize(rows, (count, 3)) for rows in (path.points, path.normals)))


@pytest.mark.parametrize(
    ("work", "samples"),
    [
        (lambda problem: problem.tubes(), 2 * ROWS * COLUMNS),
        (lambda problem: problem.rim(2.2, 6000, np.random.default_rng(0)), 2 * 6000),
        (lambda problem: problem.copies.relative_distance(on_path(problem, 9000)), 9000),
        (lambda problem: problem.displaced(problem.preparation.surface), SURFACE_SAMPLES),
        (lambda problem: problem.copies.distance(on_path(problem, 9000).points), 9000),
    ],
)
def test_a_cancel_is_heard_between_short_pieces(preparation, work, samples):
    calls = []
    stroke = Stroke(on_ball(np.linspace(1.2, 1.8, 8), 0.3), Brush(0.1, 0.05), mirror=frozenset("Z"))
    problem = pose(preparation, stroke, lambda: calls.append(None))
    calls.clear()
    work(problem)
    assert len(calls) > samples / PIECE

    def cancel():
        raise Cancelled

    with pytest.raises(Cancelled):
        work(replace(problem, check=cancel))


def test_a_mirror_image_that_misses_the_surface_is_refused():
    beside = ball(0.4).network
    weights = [w.clone() for w in beside.weights]
    biases = [beside.biases[0] - weights[0] @ weights[0].new_tensor([0.4, 0, 0]), beside.biases[1]]
    moved = type(beside)(tuple(weights), tuple(biases), beside.omegas)  # centred at (0.4, 0, 0)
    stroke = Stroke(np.array([[0.8, 0, 0]]), Brush(0.1, 0.05), mirror=frozenset("X"))
    with pytest.raises(SculptError, match="off the surface"):
        pose(prepare(Field(moved)), stroke)


def test_a_stroke_without_width_is_refused(preparation):
    points = on_ball(np.linspace(0, 1, 4), 0)
    stroke = Stroke(points, Brush(0.1, 0.05), radius_factors=np.zeros(4))
    with pytest.raises(SculptError, match="width"):
        pose(preparation, stroke)


def test_a_stroke_whose_pressure_leaves_less_than_the_least_radius_is_refused(preparation):
    """A cell of the finest level is 2 / 1024 wide, the least stroke, too."""
    points, brush = on_ball(np.linspace(0, 1, 4), 0), Brush(0.01, 0.05)
    with pytest.raises(SculptError, match=r"With its pressure .* radius of 0\.0009;"):
        pose(preparation, Stroke(points, brush, radius_factors=np.full(4, 0.09)))
    pose(preparation, Stroke(points, brush, radius_factors=np.array([0, 0, 0.1, 0])))


def test_fine_detail_elsewhere_does_not_guide_a_stroke_that_folds():
    """A carve deeper than the ball's radius of curvature crosses itself. Detail under it guides it,
    the same on the other side of the ball does not."""
    stroke = Stroke(np.array([[0, 0, 0.5]]), Brush(0.1, -0.6))
    for side, guided in (1, True), (-1, False):
        fine = distinct(cells_of(np.array([[0.0, 0, side * 0.5]], np.float32), 8), 8)
        relief = {8: Level(dilated(fine, 8), np.full(27, 1e-3, np.float32))}
        problem = pose(prepare(ball(0.5).plus(relief)), stroke)
        assert problem.is_guided is guided


def test_a_stroke_between_the_vertices_of_the_proxy_may_run_through_a_wall():
    """A carve 0.006 wide through a slab 0.1 thick: no vertex lies under it."""
    slab = prepare(ellipsoid((0.5, 0.5, 0.05)))
    mesh = slab.mesh
    middles = mesh.vertices.points[mesh.triangles].mean(axis=1)
    top = middles[(middles[:, 2] > 0) & (np.linalg.norm(middles[:, :2], axis=1) < 0.2)]
    away = KDTree(mesh.vertices.points).query(top)[0]
    problem = pose(slab, Stroke(top[[away.argmax()]].astype(float), Brush(0.003, -0.2)))
    assert not problem.covered.any()
    tubes, swept = problem.displaced_tubes(20, 21)
    assert swept is not None
    assert len(tubes[0].target.points)
    inside = swept.winding(top[[away.argmax()]] - np.array([[0, 0, 0.02]], np.float32))
    assert inside == pytest.approx(-1, abs=0.1)


def test_targets_beyond_a_thin_part_are_left_out():
    """A dab that carves deeper than a lens is thick comes out on its other side."""
    lens = prepare(ellipsoid((0.5, 0.5, 0.05)))
    problem = pose(lens, Stroke(np.array([[0, 0, 0.05]]), Brush(0.15, -0.2)))
    (tube,) = problem.tubes()
    assert len(tube.target.points) > 500
    assert values(lens.field, tube.target.points).max() < 2e-3
    alone = sample_tube(lens.field, *problem.placed[0])
    through = alone.target.points[:, 2] < -0.06
    assert through.sum() > 500
    assert len(alone.target.points) - len(tube.target.points) >= through.sum()


@pytest.mark.parametrize("height", [0.2, pytest.param(0.35, marks=pytest.mark.long)])
def test_a_surface_that_is_raised_beyond_an_axis_bounds_what_is_left(height):
    """The inner equator of the torus, 0.3 from the axis: raised by 0.35 all of it has turned over,
    and what it has swept over twice, 0.05 around the axis, is a hole."""
    turn = np.linspace(0, 2 * np.pi, 33)[:-1]
    points = 0.3 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    stroke = Stroke(points, Brush(0.05, height, Profile(table=(1, 1))), closed=True)
    (tube,) = pose(prepare(primitive("torus")), stroke).tubes()
    away = np.hypot(*tube.target.points[:, :2].T)
    np.testing.assert_allclose(away, abs(0.3 - height), atol=0.02)


def test_a_stroke_of_which_nothing_is_left_is_refused():
    """The floor of a dab without walls, all of it behind a lens 0.1 thick."""
    stroke = Stroke(np.array([[0, 0, 0.05]]), Brush(0.15, -0.2, Profile(table=(1, 1))))
    with pytest.raises(SculptError, match="nothing"):
        pose(prepare(ellipsoid((0.5, 0.5, 0.05))), stroke).tubes()


def test_a_volume_tells_inside_from_outside_only_where_planes_do_not(preparation):
    """A ridge on a ball does not run through itself; two copies that meet do."""
    points = on_ball(np.linspace(0.6, 1.0, 6), 0.3)
    alone = pose(preparation, Stroke(points, Brush(0.1, 0.05))).displaced_tubes(40, 41)
    assert alone.swept is None
    assert len(alone.tubes) == 1 and len(alone.tubes[0].target.points) > 1000
    lens = prepare(ellipsoid((0.5, 0.5, 0.2)))
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]
    carved = pose(lens, Stroke(on_ball(turn, 0), Brush(0.15, -0.16), closed=True))
    displaced = carved.displaced_tubes(60, 61)
    assert displaced.swept is not None
    np.testing.assert_allclose(
        displaced.swept.winding(np.float32([[0.42, 0, 0], [0, 0.42, 0], [0, 0, 0.6]])),
        [-1, -1, 0],
        atol=0.1,
    )


def test_distances_in_a_hole_are_those_from_its_wall():
    """A dab through a thin lens, whose faces are all but level there. Triangles at the wall's end
    have edges of a sixteenth of the radius, and reach beyond it by half of that."""
    lens = prepare(ellipsoid((0.5, 0.5, 0.05)))
    brush = Brush(0.15, -0.2)
    problem = pose(lens, Stroke(np.array([[0, 0, 0.05]]), brush))
    away = np.linspace(0, 0.15, 2001)
    face = 0.05 * np.sqrt(1 - (away / 0.5) ** 2)
    floor = face - 0.2 * brush.profile(away / 0.15)
    left = floor > -face
    points = np.stack([np.linspace(0, 0.08, 9), np.zeros(9), np.linspace(0.03, -0.03, 9)], axis=1)
    there = np.hypot(points[:, :1] - away[left], points[:, 2:] - floor[left]).min(axis=1)
    np.testing.assert_allclose(
        problem.folded.distance(points.astype(np.float32)), there, atol=0.15 / 32
    )


def test_a_fin_thinner_than_a_cell_of_the_proxy_is_seen_from_both_sides(preparation):
    """It stands on a ball, 0.008 thick, in the middle of the proxy's cells, 0.016 wide."""
    level = 8
    size = np.array([0.1, 0.03, 0.1])
    box = [0.5, 0, 0] + size * np.stack(np.mgrid[-1:1:60j, -1:1:20j, -1:1:60j], axis=-1)
    cells = distinct(cells_of(box.reshape(-1, 3), level), level)
    nodes = centres(places(cells, level), level)
    away = np.linalg.norm(nodes, axis=1)
    f = values(preparation.field, nodes)
    fin = np.maximum(np.maximum(np.abs(nodes[:, 1] - 1 / CELLS) - 0.004, away - 0.55), 0.4 - away)
    added = {level: Level(cells, quantised(np.minimum(fin, f) - f))}
    fine = prepare(preparation.field.plus(added))
    under = pose(fine, Stroke(on_ball([0.08], 0), Brush(0.1, 0.04))).folded.under
    mesh = under.before.points.astype(float), under.triangles
    angle, height = np.meshgrid(np.linspace(-0.06, 0.06, 13), np.linspace(0.51, 0.545, 8))
    for side in (-0.004, 0.004):
        aside = np.full_like(angle, 1 / CELLS + side)
        points = np.stack([height * np.cos(angle), aside, height * np.sin(angle)], axis=-1)
        square, face, _ = igl.point_mesh_squared_distance(points.reshape(-1, 3), *mesh)
        assert np.sqrt(square.max()) < 5e-4
        a, b, c = (mesh[0][corner] for corner in mesh[1][face].T)
        assert (np.cross(b - a, c - a)[:, 1] * side > 0).all()


@pytest.mark.parametrize("intensity", [0.05, -0.05, 0.15])
def test_samples_are_as_many_as_the_surface_is_stretched(preparation, intensity):
    """Around the equator of a ball the displaced surface is one of revolution: it has as many more
    samples than the ball's as it has more area."""
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]

    def count(height):
        brush = Brush(0.1, height, Profile("linear"))
        stroke = Stroke(on_ball(turn, 0), brush, closed=True)
        random = np.random.default_rng(0)
        surface = pose(preparation, stroke).displaced_surface(300, 40, random, 0.005, 1, 1)
        return len(surface.after.points)

    latitude = np.linspace(-1, 1, 4001) * 2 * np.arcsin(0.1)
    across = np.abs(np.sin(latitude / 2)) / 0.1

    def area(height):
        radius = 0.5 + height * (1 - across)
        return trapezoid(
            radius * np.cos(latitude) * np.hypot(radius, np.gradient(radius, latitude)), latitude
        )

    assert count(intensity) / count(1e-4) == pytest.approx(area(intensity) / area(0), rel=0.05)
