# SPDX-License-Identifier: GPL-3.0-or-later
"""Symmetry against rotations written by hand, and groups whose sizes are known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.stroke.alpha import Alpha
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import MOST_COPIES, Stroke
from neural_sculpt_addon.stroke.symmetry import ONCE, images

SKEW = Profile(points=((-1, 0), (-0.5, 1), (0.5, -1), (1, 0)))
PLACE = np.array([0.1, 0.2, 0.3])

mirrors = st.frozensets(st.sampled_from("XYZ"))
one_axis = st.tuples(st.integers(0, 2), st.integers(1, 64)).map(
    lambda drawn: tuple(drawn[1] if axis == drawn[0] else 1 for axis in range(3))
)
any_axes = st.tuples(*[st.integers(1, 7)] * 3)


def contains(found, matrix):
    return (np.abs(found - matrix).max(axis=(1, 2)) < 1e-12).any()


def stroke(points, **words):
    return Stroke(np.array(points, float).reshape(-1, 3), Brush(0.1, 0.1, SKEW), **words)


def ring(count, **words):
    angle = 2 * np.pi * np.arange(count) / count
    points = np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), 0 * angle + 0.4], axis=1)
    return stroke(points, closed=True, **words)


@pytest.mark.parametrize(
    ("radial", "expected"),
    [
        ((4, 1, 1), [(0.1, 0.2, 0.3), (0.1, -0.3, 0.2), (0.1, -0.2, -0.3), (0.1, 0.3, -0.2)]),
        ((1, 4, 1), [(0.1, 0.2, 0.3), (0.3, 0.2, -0.1), (-0.1, 0.2, -0.3), (-0.3, 0.2, 0.1)]),
        ((1, 1, 4), [(0.1, 0.2, 0.3), (-0.2, 0.1, 0.3), (-0.1, -0.2, 0.3), (0.2, -0.1, 0.3)]),
    ],
)
def test_quarter_turns_are_exact(radial, expected):
    assert (images(frozenset(), radial) @ PLACE).tolist() == [list(place) for place in expected]


def test_a_third_of_a_turn():
    half, root = 0.5, 3**0.5 / 2
    turned = images(frozenset(), (1, 1, 3))[1] @ PLACE
    expected = [-half * 0.1 - root * 0.2, root * 0.1 - half * 0.2, 0.3]
    np.testing.assert_allclose(turned, expected, atol=1e-15)


@pytest.mark.parametrize(
    ("mirror", "radial", "count"),
    [
        ("", ONCE, 1),
        ("XYZ", ONCE, 8),
        ("", (1, 1, 5), 5),
        ("X", (1, 1, 5), 10),
        ("Z", (1, 1, 5), 10),
        ("XY", (1, 1, 2), 4),  # half a turn is both reflections
        ("XY", (1, 1, 3), 12),
        ("XY", (1, 1, 4), 8),
        ("XYZ", (1, 1, 4), 16),
        ("", (2, 2, 2), 4),
        ("", (3, 1, 4), 1 + 2 + 3),  # turns about different axes are not chained
        ("", (64, 64, 64), 1 + 3 * 63),
    ],
)
def test_the_number_of_images(mirror, radial, count):
    assert len(images(frozenset(mirror), radial)) == count


@given(mirrors, one_axis)
def test_reflections_and_turns_about_one_axis_are_a_group(mirror, radial):
    found = images(mirror, radial)
    np.testing.assert_array_equal(found[0], np.eye(3))
    np.testing.assert_allclose(found @ found.swapaxes(1, 2), [np.eye(3)] * len(found), atol=1e-12)
    apart = np.abs(found[:, None] - found).max(axis=(2, 3)) + np.eye(len(found))
    assert apart.min() > 1e-3
    some = found[:: max(len(found) // 8, 1)]
    assert all(contains(found, one @ other) for one in some for other in some)


@given(mirrors, any_axes)
def test_they_are_each_reflection_turned_about_each_axis(mirror, radial):
    found = images(mirror, radial)
    assert all(contains(found, image.T) for image in found)
    alone = [
        images(mirror, tuple(radial[k] if k == axis else 1 for k in range(3))) for axis in range(3)
    ]
    assert all(contains(found, image) for part in alone for image in part)
    assert all(any(contains(part, image) for part in alone) for image in found)


def test_a_rotation_leaves_the_profile_and_a_reflection_flips_it():
    copies = stroke([PLACE], mirror=frozenset("Z"), radial=(1, 1, 4)).copies()
    places = {
        tuple(copy.points[0].round(12).tolist()): copy.brush.profile == SKEW for copy in copies
    }
    around = [(0.1, 0.2), (-0.2, 0.1), (-0.1, -0.2), (0.2, -0.1)]
    assert places == {(x, y, z): z > 0 for x, y in around for z in (0.3, -0.3)}
    assert all(copy.radial == ONCE and not copy.mirror for copy in copies)


def test_a_dab_on_the_axis_is_one():
    even = Stroke(np.array([[0, 0, 0.5]]), Brush(0.1, 0.1), radial=(1, 1, 6))
    assert len(even.copies()) == 1
    assert len(replace(even, mirror=frozenset("Z")).copies()) == 2
    assert len(replace(even, points=np.array([[1e-3, 0, 0.5]])).copies()) == 6
    assert len(stroke([0, 0, 0.5], radial=(1, 1, 6)).copies()) == 6  # one-sided, it is turned


def test_a_dab_with_an_alpha_is_turned_with_its_picture():
    picture = Alpha(pixels=bytes([255, 0, 0, 0]))
    brush = Brush(0.1, 0.1, Profile("quintic"), alpha=picture)
    dab = Stroke(np.array([[0, 0, 0.5]]), brush, radial=(1, 1, 4))
    assert len(dab.copies()) == 4
    assert len(replace(dab, brush=replace(brush, alpha=None)).copies()) == 1


@pytest.mark.parametrize(
    ("count", "radial", "modulation", "copies"),
    [
        (12, 4, "identity", 1),
        (12, 5, "identity", 5),
        (12, 4, "linear", 4),  # its start is seen
        (12, 4, "central", 4),
    ],
)
def test_rings_around_the_axis(count, radial, modulation, copies):
    drawn = ring(count, radial=(1, 1, radial))
    brush = replace(drawn.brush, modulation=Modulation(modulation))
    assert len(replace(drawn, brush=brush).copies()) == copies


def test_a_ring_whose_width_changes_is_turned():
    wide = np.where(np.arange(12) % 3 == 0, 2.0, 1.0)
    assert len(ring(12, radial=(1, 1, 4), radius_factors=wide).copies()) == 1
    assert len(ring(12, radial=(1, 1, 6), radius_factors=wide).copies()) == 3


def test_a_stroke_across_a_mirror_plane_is_one_where_it_is_symmetric():
    across = stroke([[-0.2, 0.1, 0.4], [0, 0.1, 0.5], [0.2, 0.1, 0.4]], mirror=frozenset("X"))
    assert len(across.copies()) == 1
    falling = replace(across.brush, modulation=Modulation("linear"))
    assert len(replace(across, brush=falling).copies()) == 2
    assert len(replace(across, intensity_factors=np.array([1, 1, 0.5])).copies()) == 2
    turned = replace(across, mirror=frozenset(), radial=(1, 1, 2))
    assert len(turned.copies()) == 2  # at y = 0.1 and at y = -0.1
    through = replace(turned, points=across.points * [1, 0, 1])
    assert len(through.copies()) == 2  # the profile is one-sided
    assert len(replace(through, brush=Brush(0.1, 0.1)).copies()) == 1


@pytest.mark.parametrize("closed", [False, True])
def test_two_points_are_a_line_with_two_sides_though_it_is_marked_closed(closed):
    """In the plane of the mirror, and turned by 180 degrees about its middle: the other side of a
    one-sided profile is displaced."""
    line = stroke([[-0.2, 0, 0.4], [0.2, 0, 0.4]], closed=closed)
    for words in ({"mirror": frozenset("Y")}, {"radial": (1, 1, 2)}):
        assert len(replace(line, **words).copies()) == 2
        assert len(replace(line, brush=Brush(0.1, 0.1), **words).copies()) == 1


@pytest.mark.parametrize("radial", [(0, 1, 1), (1, 65, 1), (1, 1, -3), (1, 1)])
def test_counts_out_of_bounds_are_refused(radial):
    with pytest.raises(SculptError, match="1 to 64"):
        stroke([PLACE], radial=radial)


def test_too_many_copies_are_refused_with_their_number():
    most = stroke([PLACE], mirror=frozenset("X"), radial=(1, 1, 64))
    assert len(most.copies()) == MOST_COPIES == 128
    with pytest.raises(SculptError, match="256 times; at most 128"):
        replace(most, mirror=frozenset("XZ"))


def test_a_copy_outside_of_the_box_is_left_out():
    """An eighth of a turn brings (0.9, 0.9) to (0, 1.27), a quarter to (-0.9, 0.9)."""
    corner = [0.9, 0.9, 0.1]
    within = stroke([corner], radial=(1, 1, 4))
    assert (len(within.copies()), within.left_out) == (4, 0)
    beyond = stroke([corner], radial=(1, 1, 8))
    assert beyond.left_out == 4
    found = np.array([copy.points[0] for copy in beyond.copies()])
    np.testing.assert_allclose(found, [copy.points[0] for copy in within.copies()], atol=1e-12)
    half = stroke([corner, [0.5, 0.5, 0.1]], radial=(1, 1, 8))  # of which an end would leave it
    assert (len(half.copies()), half.left_out) == (4, 4)


def test_files_hold_the_counts():
    data = stroke([PLACE], radial=(1, 1, 6)).to_json()
    assert data["radial"] == [1, 1, 6]
    assert Stroke.from_json(data).radial == (1, 1, 6)
    assert "radial" not in stroke([PLACE]).to_json()
    assert "image" not in stroke([PLACE], radial=(1, 1, 6)).copies()[1].to_json()
