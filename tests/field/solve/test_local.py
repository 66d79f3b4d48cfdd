# SPDX-License-Identifier: GPL-3.0-or-later
"""The local solver against displaced spheres in closed form, and what it must leave as it is."""

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.field import threads
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.levels import SUPPORT, Level, cells_of, linear, quantised, support
from neural_sculpt_addon.field.mesh.pieces import Islands, components
from neural_sculpt_addon.field.mesh.proxy import extract, update
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import Preparation, prepare
from neural_sculpt_addon.field.solve.local import LocalEdit
from neural_sculpt_addon.field.solve.resolution import DENSITY, resolution
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball, ellipsoid, thin_lens
from tests.field.solve.strokes import PEAKS, POLE, arc, belt, on_ball, plateau

TOP = np.array([[-0.2, 0, 0.029], [0.2, 0, 0.029]])  # on the plate


def height(brush, away):
    """Of the displaced sphere of radius 1/2, by angle (N,) from the stroke."""
    t = np.minimum(np.sin(np.abs(away) / 2) / brush.radius, 1)  # a chord, in radii
    return brush.intensity * (1 - 10 * t**3 + 15 * t**4 - 6 * t**5)


def distance_from_middle(field, directions, start):
    """Where rays (N, 3) from the middle meet f = 0, sought from `start` (N,)."""
    for _ in range(5):
        value, gradient = values_and_gradients(field, start[:, None] * directions)
        start = start - value / np.einsum("na,na->n", gradient, directions)
    return start


def plate(steepness):
    """A lens 1.6 wide and 0.06 thick, on top of which |grad f| is `steepness`."""
    lens = ellipsoid((0.8, 0.8, 0.03)).network
    *rest, weight, bias = lens.parameters
    share = steepness / (1.63 / 3 / 0.03)  # the mean axis by the least one
    return prepare(Field(lens.with_parameters([*rest, share * weight, share * bias])))


@pytest.fixture(scope="module")
def lens():
    return plate(1.0)


@pytest.fixture(scope="module")
def dab(preparation):
    return sculpt(preparation, Stroke(POLE, Brush(0.15, 0.05)))


@pytest.mark.parametrize(
    "brush", [Brush(0.2, 0.05), Brush(0.15, -0.05), Brush(0.1, 0.03), Brush(0.05, 0.01)]
)
def test_a_dab_on_a_sphere(preparation, brush):
    edit = sculpt(preparation, Stroke(POLE, brush))
    random = np.random.default_rng(1)
    away = np.arccos(random.uniform(np.cos(2.8 * np.arcsin(brush.radius)), 1, 4000))
    rays = on_ball(random.uniform(0, 2 * np.pi, 4000), np.pi / 2 - away, 1.0)
    expected = 0.5 + height(brush, away)
    error = np.abs(distance_from_middle(edit.field, rays, expected) - expected)
    assert error.mean() < 1e-4
    assert error.max() < 1e-3


@pytest.mark.parametrize("brush", [Brush(0.2, 0.05), Brush(0.1, -0.03)])
def test_a_belt_around_a_sphere(preparation, brush):
    edit = sculpt(preparation, belt(brush))
    random = np.random.default_rng(2)
    latitude = 2.8 * np.arcsin(brush.radius) * random.uniform(-1, 1, 6000)
    rays = on_ball(random.uniform(0, 2 * np.pi, 6000), latitude, 1.0)
    expected = 0.5 + height(brush, latitude)
    error = np.abs(distance_from_middle(edit.field, rays, expected) - expected)
    assert error.mean() < 1e-4
    assert error.max() < 1e-3


def test_a_stroke_upon_detail_of_another_is_as_close(preparation):
    """Two dabs on the same place add up: the second one starts from 0.53 instead of 0.5."""
    first = sculpt(preparation, Stroke(POLE, Brush(0.2, 0.03)))
    top = POLE * 1.06
    second = sculpt(first.preparation, Stroke(top, Brush(0.1, 0.03)))
    found = distance_from_middle(second.field, np.array([[0, 0, 1.0]]), np.array([0.56]))
    assert found[0] == pytest.approx(0.56, abs=1e-3)
    random = np.random.default_rng(3)
    away = np.arccos(random.uniform(np.cos(0.4), np.cos(0.23), 2000))  # the first one alone
    rays = on_ball(random.uniform(0, 2 * np.pi, 2000), np.pi / 2 - away, 1.0)
    expected = 0.5 + height(Brush(0.2, 0.03), away)
    error = np.abs(distance_from_middle(second.field, rays, expected) - expected)
    assert error.mean() < 1e-4


def test_outside_of_the_layer_the_field_is_what_it_was_to_the_bit(preparation, dab):
    points = np.random.default_rng(4).uniform(-1, 1, (100_000, 3)).astype(np.float32)
    points[::2] = 0.3 * points[::2] + np.float32([0, 0, 0.5])
    reached = np.isin(linear(cells_of(points, SUPPORT), SUPPORT), support(dab.layer))
    assert 1000 < reached.sum() < 50_000
    before, after = (values_and_gradients(e, points) for e in (preparation.field, dab.field))
    for was, now in zip(before, after, strict=True):
        np.testing.assert_array_equal(was[~reached], now[~reached])
    assert (before[0] != after[0]).sum() > 1000
    assert np.linalg.norm(points[before[0] != after[0]] - POLE[0], axis=1).max() < 0.3


def test_a_layer_is_all_that_was_added(preparation, dab):
    """In whole multiples, so that taking it away again leaves the field that was."""
    points = np.random.default_rng(5).uniform(-0.7, 0.7, (5000, 3))
    np.testing.assert_array_equal(
        values(dab.field, points), values(preparation.field.plus(dab.layer), points)
    )
    np.testing.assert_array_equal(
        values(dab.field.plus(dab.layer, -1), points), values(preparation.field, points)
    )
    for part in dab.layer.values():
        np.testing.assert_array_equal(part.values, quantised(part.values))
        assert (np.diff(part.index) > 0).all()
    assert dab.field.network is preparation.field.network


def test_mirror_images_are_alike(preparation):
    edit = sculpt(preparation, arc(Brush(0.1, 0.04), mirror=frozenset("XZ")))
    random = np.random.default_rng(6)
    rays = on_ball(random.uniform(0, np.pi, 4000), random.uniform(-1, 1, 4000), 1.0)
    found = distance_from_middle(edit.field, rays, np.full(4000, 0.52))
    for signs in ((-1, 1, 1), (1, 1, -1), (-1, 1, -1)):
        image = distance_from_middle(edit.field, rays * signs, np.full(4000, 0.52))
        assert np.abs(image - found).mean() < 2e-5
        assert np.abs(image - found).max() < 5e-4
    moved = distance_from_middle(edit.field, on_ball(0.7, [-0.4, 0.4], 1.0), np.full(2, 0.54))
    np.testing.assert_allclose(moved, 0.54, atol=2e-4)


@pytest.mark.parametrize(("radial", "mirror"), [((1, 1, 4), ""), ((5, 1, 1), "X")])
def test_turned_images_are_alike(preparation, radial, mirror):
    """Quarter turns bring cells upon cells; fifths do not."""
    stroke = arc(Brush(0.1, 0.04), radial=radial, mirror=frozenset(mirror))
    edit = sculpt(preparation, stroke)
    random = np.random.default_rng(6)
    rays = on_ball(random.uniform(0, 2 * np.pi, 8000), np.arcsin(random.uniform(-1, 1, 8000)), 1.0)
    found = distance_from_middle(edit.field, rays, np.full(8000, 0.52))
    assert ((found > 0.53).mean()) > 0.02
    assert len(stroke.images) == max(radial) * 2 ** len(mirror)
    for image in stroke.images[1:]:
        turned = distance_from_middle(edit.field, rays @ image.T, np.full(8000, 0.52))
        assert np.abs(turned - found).mean() < 2e-5
        assert np.percentile(np.abs(turned - found), 99) < 1.5e-4
        assert np.abs(turned - found).max() < 5e-4
    middles = on_ball(0.7, [0.4], 1.0) @ stroke.images.swapaxes(1, 2)
    moved = distance_from_middle(edit.field, middles[:, 0], np.full(len(middles), 0.54))
    np.testing.assert_allclose(moved, 0.54, atol=2e-4)
    assert edit.report()["tolerance_met"]


def test_of_turned_images_that_overlap_the_larger_displacement_wins(preparation):
    """Four dabs around the pole, each of which reaches beyond it."""
    brush, tilt = Brush(0.2, 0.03), 0.2
    edit = sculpt(preparation, Stroke(on_ball(0.3, [np.pi / 2 - tilt]), brush, radial=(1, 1, 4)))
    random = np.random.default_rng(8)
    latitude = np.pi / 2 - 0.7 * np.sqrt(random.uniform(0, 1, 5000))
    rays = on_ball(random.uniform(0, 2 * np.pi, 5000), latitude, 1.0)
    middles = on_ball(0.3 + np.pi / 2 * np.arange(4), np.pi / 2 - tilt, 1.0)
    away = np.arccos(np.clip(rays @ middles.T, -1, 1))  # (N, 4)
    expected = 0.5 + height(brush, away).max(axis=1)
    assert np.count_nonzero((away < 0.35).sum(axis=1) > 1) > 500
    found = distance_from_middle(edit.field, rays, expected)
    assert np.abs(found - expected).mean() < 2e-4
    assert np.abs(found - expected).max() < 3e-3  # where two of them meet there is an edge


@pytest.mark.parametrize("intensity", [0.03, -0.02])
def test_the_other_sheet_of_a_thin_plate_stays(lens, intensity):
    edit = sculpt(lens, Stroke(TOP, Brush(0.1, intensity)))
    place = np.random.default_rng(7).uniform(-0.35, 0.35, (6000, 2))
    depth = 0.03 * np.sqrt(1 - np.square(place / 0.8).sum(axis=1))
    below = np.column_stack([place, -depth])
    for _ in range(4):
        value, gradient = values_and_gradients(edit.field, below)
        below[:, 2] -= value / gradient[:, 2]
    assert np.abs(below[:, 2] + depth).mean() < 2e-5
    assert np.abs(below[:, 2] + depth).max() < 3e-4
    above = np.array([[0, 0, 0.03 + intensity]])
    assert np.abs(values(edit.field, above)[0]) < 5e-4
    assert components(edit.proxy) == 1


def test_what_asks_for_nothing_gets_no_finer_level(preparation):
    edit = sculpt(preparation, arc(Brush(0.05, 0.0)))
    assert max(edit.layer) == resolution(edit.problem).level
    assert edit.report()["tolerance_met"]


@pytest.mark.parametrize("height", [2e-3, -3e-4])
@pytest.mark.parametrize("radius", [0.03, 0.06])
def test_of_a_faint_stroke_as_much_is_reached_as_of_a_high_one(preparation, radius, height):
    """What a high one may be off is a fifth of the first, and more than all of the second."""
    for profile in Profile("linear"), PEAKS, plateau(0.3):
        edit = sculpt(preparation, arc(Brush(radius, height, profile)))
        report = edit.report()
        assert report["tube_p95"] < 0.05 * abs(height)
        assert report["gain"] == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("radius", [0.1, 0.04])
def test_samples_of_the_displaced_surface_are_as_many_as_density_says(preparation, radius):
    """Under a belt around a ball, whose zone has the area of the cylinder around it."""
    problem = pose(preparation, belt(Brush(radius, 1e-5)))
    edit = LocalEdit(problem)
    half = radius * np.sqrt(1 - radius**2)  # height over the equator where the chord is a radius
    area = 2 * np.pi * 0.5 * 2 * half
    expected = DENSITY * area * 4.0**edit.resolution.level
    assert len(edit.targets) == pytest.approx(expected, rel=0.1)


@pytest.mark.long
def test_a_stroke_that_is_too_large_gets_a_coarser_level_and_says_so(preparation):
    combed = Profile(table=(0.0, 1.0) * 16 + (0.0,))  # as fine as 0.3 / 32
    small, large = (
        pose(preparation, belt(brush)) for brush in (Brush(0.05, 0.05), Brush(0.15, 0.01, combed))
    )
    assert resolution(small).level == resolution(small).wanted
    edit = LocalEdit(large)
    assert edit.resolution == resolution(large)
    assert edit.resolution.level < edit.resolution.wanted
    levels = set(edit.solve())
    assert {edit.resolution.level - 1, edit.resolution.level} <= levels
    assert min(levels) == edit.resolution.level - 1


def test_what_no_level_can_hold_is_refused(preparation):
    uneven = on_ball(np.linspace(0, 6.2, 25) ** 1.01, 0.1)  # whose images do not coincide
    stroke = Stroke(uneven, Brush(0.9, 0.3), closed=True, mirror=frozenset("XYZ"))
    with pytest.raises(SculptError, match="smaller radius"):
        LocalEdit(pose(preparation, stroke))


def test_the_number_of_threads_changes_no_bit(preparation, cores):
    stroke, layers = arc(Brush(0.1, 0.05), mirror=frozenset("Z")), []
    for number in (1, 2, 3):
        cores(number)
        assert threads.threads() == number
        layers.append(sculpt(prepare(preparation.field), stroke).layer)
    first, *others = layers
    assert sum(len(part.index) for part in first.values()) > 1000
    for other in others:
        assert other.keys() == first.keys()
        for level, part in other.items():
            np.testing.assert_array_equal(part.index, first[level].index)
            np.testing.assert_array_equal(part.values, first[level].values)


def figure_of_eight(intensity):
    turn = np.linspace(0, 2 * np.pi, 31)[:-1]
    points = on_ball(0.5 * np.sin(turn), 0.25 * np.sin(2 * turn))
    return prepare(ball(0.5)), Stroke(points, Brush(0.08, intensity), closed=True)


def edge_of_a_lens(intensity):
    """Carved by more than the 0.08 that its meridian is curved by."""
    turn = np.linspace(0, 2 * np.pi, 65)[:-1]
    brush = Brush(0.15, intensity)
    return prepare(ellipsoid((0.5, 0.5, 0.2))), Stroke(on_ball(turn, 0), brush, closed=True)


def hole_of_a_torus(intensity):
    """0.3 wide, which the stroke all but fills."""
    turn = np.linspace(0, 2 * np.pi, 33)[:-1]
    return prepare(primitive("torus")), Stroke(
        on_ball(turn, 0, 0.3), Brush(0.1, intensity), closed=True
    )


def images_that_meet(intensity):
    points = on_ball(np.linspace(1.3, 1.5, 5), 0.2)
    return prepare(ball(0.5)), Stroke(points, Brush(0.12, intensity), mirror=frozenset("X"))


@pytest.mark.parametrize(
    ("make", "intensity"),
    [
        (figure_of_eight, 0.06),
        (figure_of_eight, -0.15),
        (edge_of_a_lens, -0.16),
        (hole_of_a_torus, 0.26),
        (images_that_meet, 0.1),
    ],
)
def test_where_the_displaced_surface_meets_itself_there_is_one_piece(make, intensity):
    before, stroke = make(intensity)
    edit = sculpt(before, stroke)
    assert components(edit.proxy) == 1
    assert np.abs(values(before.field, edit.proxy.vertices)).max() > 0.05


def test_a_carve_with_a_flat_floor_through_a_thin_part_leaves_no_plug():
    """A hole of radius 0.12 to 0.15 in a lens 0.1 thick: none of its floor bounds anything."""
    flat = Profile(points=((-1, 0), (-0.8, 1), (0.8, 1), (1, 0)))
    stroke = Stroke(np.array([[0, 0, 0.05]]), Brush(0.15, -0.2, flat))
    edit = sculpt(prepare(thin_lens()), stroke)
    assert components(edit.proxy) == components(extract(edit.field, 256)) == 1
    away = np.float32([0, 0.03, 0.06, 0.09, 0.18, 0.3])
    middle = np.stack([away, 0 * away, 0 * away], axis=1)
    np.testing.assert_array_equal(values(edit.field, middle) > 0, away < 0.12)


def test_a_cancel_ends_it_wherever_it_comes(preparation):
    stroke = arc(Brush(0.1, 0.03))

    def calls(last=None):
        heard = []

        def progress(fraction, message):
            heard.append((fraction, message))
            if len(heard) == last:
                raise Cancelled

        try:
            sculpt(preparation, stroke, progress=progress)
        except Cancelled:
            assert last is not None
        return heard

    whole = calls()
    assert all(0 <= fraction <= 1 and message for fraction, message in whole)
    for last in (1, 2, len(whole) // 3, 2 * len(whole) // 3, len(whole)):
        assert len(calls(last)) == last


@pytest.mark.parametrize("radius", [0.04, 0.06, 0.1])
def test_a_crease_is_even_along_its_bottom(preparation, radius):
    """A groove like a V, whose bottom lies on a smaller ball: rounded off, but not toothed. Turned
    about the axis, so that it lies elsewhere in the cells, it deviates by 0.29e-3 to 0.43e-3."""

    def path(longitudes):
        return longitudes, 0.1 * np.sin(2 * longitudes)

    depth = 0.8 * radius
    groove = Brush(radius, -depth, Profile("linear"))
    done = sculpt(preparation, Stroke(on_ball(*path(np.linspace(-0.6, 0.6, 24))), groove))
    rays = on_ball(*path(np.linspace(-0.45, 0.45, 400)), 1.0)
    bottom = distance_from_middle(done.field, rays, np.full(400, 0.5 - depth)) - (0.5 - depth)
    assert 0 < bottom.mean() < 1.5e-3
    assert bottom.std() < 7e-4


@pytest.mark.parametrize(("radius", "height"), [(0.03, 0.14), (0.04, 0.18)])
def test_a_high_ridge_has_no_crumbs_beside_it(radius, height):
    """Coefficients of the finest level alone would be as large as it is high, and f would swing
    between them: crumbs too small for the proxy."""
    ridge = Stroke(on_ball(np.linspace(0, 0.6, 12), 0), Brush(radius, height))
    done = sculpt(prepare(ball(0.5)), ridge)
    assert components(extract(done.field, 256)) == 1


def test_a_high_thin_stroke_counts_as_a_cell_wide_on_each_side():
    """A wall 0.368 long and 1 high, of cells 1 / 512 wide: 2 * 188 * (512 + 5) are too many."""
    points = on_ball(np.linspace(0.4, 1.2, 7), 0.4)
    found = resolution(pose(prepare(ball(0.5)), Stroke(points, Brush(1e-3, 1.0))))
    assert found.is_limited
    assert found.level == 8


def test_islands_are_solved_away_and_the_stroke_stays():
    """A drop above the place of a dab: forbidden, it is gone, and the dab is as high as before."""
    nodes = (
        cells_of(np.array([[0, 0, 0.6]], np.float32), 5) + np.indices((2, 2, 2)).reshape(3, -1).T
    )
    index = np.sort(linear(nodes.astype(np.int32), 5))
    drop = {5: Level(index, quantised(np.full(8, -0.15)))}
    field = ball(0.5).plus(drop)
    before = Preparation(field, update(extract(ball(0.5), 128), field, support(drop)))
    assert components(before.proxy) == 2
    edit = LocalEdit(pose(before, Stroke(POLE, brush := Brush(0.15, 0.03))))
    layer = edit.solve()
    for _ in range(5):
        after = field.plus(layer)
        proxy = update(before.proxy, after, support(layer))
        points = proxy.vertices[proxy.vertices[:, 2] > 0.54]
        if not len(points):
            break
        layer = edit.forbid(Islands(points, np.full(len(points), 0.02)))
        assert (values(field.plus(layer), points) > 0).all()
    assert components(proxy) == 1 and not len(points)
    away = np.linspace(0, 0.2, 30)
    directions = on_ball(0, np.pi / 2 - away, 1.0).astype(np.float32)
    reached = distance_from_middle(after, directions, 0.5 + height(brush, away))
    np.testing.assert_allclose(reached, 0.5 + height(brush, away), atol=1e-3)
