# SPDX-License-Identifier: GPL-3.0-or-later
"""The level of a stroke: features of its curves, and the budget."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.solve.resolution import resolution, turns
from neural_sculpt_addon.stroke.alpha import Alpha
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.solve.strokes import POLE, arc, on_ball, plateau


@pytest.mark.parametrize("radius", [0.15, 0.06, 0.03, 0.015])
@pytest.mark.parametrize("peaks", [1, 2, 4])
def test_the_level_follows_from_the_narrowest_rise(preparation, radius, peaks):
    """A cell is smaller than it; where that misses, a finer level halves it."""
    x = np.linspace(-1, 1, 2 * peaks + 1)
    profile = Profile(points=tuple((a, float(number % 2)) for number, a in enumerate(x)))
    found = resolution(pose(preparation, Stroke(POLE, Brush(radius, 0.002, profile))))
    rise = 2 * radius / (2 * peaks)
    assert 2**-found.wanted < 0.75 * rise
    assert found.level == found.wanted
    assert found.wanted == 6 or 2**-found.wanted > rise / 8


@pytest.mark.parametrize("wall", [0.1, 0.25, 0.4])
def test_a_plateau_is_one_feature_however_it_is_rounded(preparation, wall):
    """Its points mean a spline that is flat but for the last bit."""
    heights = plateau(wall)(np.linspace(-1, 1, 257))
    flat = heights > 1 - 1e-12
    assert len(set(heights[flat])) > 1
    exact = Profile(table=tuple(np.where(flat, 1.0, heights)))
    wanted = [
        resolution(pose(preparation, Stroke(POLE, Brush(0.03, 0.002, profile)))).wanted
        for profile in (plateau(wall), exact)
    ]
    assert wanted[0] == wanted[1]


def test_what_is_steeper_gets_smaller_cells_down_to_walls_that_are_cliffs(preparation):
    """A wall is some 2 cells wide; a smooth profile is as it was."""

    def level(profile: Profile) -> int:
        return resolution(pose(preparation, Stroke(POLE, Brush(0.06, 0.002, profile)))).wanted

    levels = [level(plateau(wall)) for wall in (0.3, 0.15, 0.08, 0.04, 0.02)]
    assert levels == sorted(levels)
    assert levels[0] < levels[2]
    assert levels[3] == levels[4]
    for wall, found in zip((0.3, 0.15), levels, strict=False):
        assert 1 < wall * 0.06 * 2**found < 4
    smooth = [level(Profile(name)) for name in ("linear", "cubic", "quintic")]
    assert len({*smooth}) == 1


@given(st.lists(st.floats(-1, 1), min_size=2, max_size=9), st.integers(0, 2**32 - 1))
def test_what_is_smaller_than_a_hundredth_of_the_height_is_no_feature(heights, seed):
    """A curve through some heights turns as often as they do, also with noise on it."""
    heights = [0.0, *heights, 0.0]
    assume(min(abs(np.diff(heights))) > 0.05 and max(map(abs, heights)) > 0.5)
    expected = int((np.diff(np.sign(np.diff(heights))) != 0).sum())
    noise = np.random.default_rng(seed).uniform(-1e-3, 1e-3, 257)
    curve = np.interp(np.linspace(0, 1, 257), np.linspace(0, 1, len(heights)), heights)
    assert turns(curve + noise) == expected


@pytest.mark.parametrize("step", [0, 0.005])
def test_a_modulation_that_is_flat_is_no_wall(preparation, step):
    """But for the last bit, or half a percent."""
    flat = Modulation(points=((0, 1), (0.3, 1), (0.7, 1 - step), (1, 1 - step)))
    assert len(set(flat(np.linspace(0, 1, 257)))) > 1
    wanted = [
        resolution(pose(preparation, arc(Brush(0.03, 0.02, modulation=modulation)))).wanted
        for modulation in (flat, Modulation("identity"))
    ]
    assert wanted[0] == wanted[1]


@pytest.mark.parametrize("peaks", [4, 9, 18])
def test_a_modulation_is_held_as_well_as_a_profile(preparation, peaks):
    """Beads along an arc: each of them rises within half of its length."""
    x = np.linspace(0, 1, 2 * peaks + 1)
    beads = Modulation(points=tuple((a, float(number % 2)) for number, a in enumerate(x)))
    found = resolution(pose(preparation, arc(Brush(0.1, 0.002, modulation=beads))))
    rise = 0.5 * np.cos(0.4) * 0.6 / (2 * peaks)
    assert 2**-found.wanted < 0.75 * rise
    assert found.wanted == 6 or 2**-found.wanted > rise / 8


@pytest.mark.parametrize("lowest", [-1, -2])
def test_a_modulation_below_zero_is_as_high_as_one_above(preparation, lowest):
    """The same displacement, of the other sign in both: 0.15 and 0.3 high, 0.03 wide."""
    below = Modulation(points=((0, lowest), (1, lowest)))
    above = Modulation(points=((0, -lowest), (1, -lowest)))
    wanted = [
        resolution(pose(preparation, arc(Brush(0.03, intensity, modulation=modulation))))
        for intensity, modulation in ((0.15, below), (-0.15, above))
    ]
    assert wanted[0] == wanted[1]


def test_two_peaks_across_a_stroke_are_four_rises(preparation):
    """Each of them is 2 cells of level 7.4 wide."""
    radius = 2 * 2 * 2**-7.4
    peaks = Profile(points=((-1, 0), (-0.5, 1), (0, 0), (0.5, 1), (1, 0)))
    assert resolution(pose(preparation, Stroke(POLE, Brush(radius, 0.002, peaks)))).wanted == 7


def test_a_hump_along_a_stroke_is_two_rises(preparation):
    """Each half of it is 2 cells of level 7.4 long, and narrower than the stroke's half."""
    length = 2 * 2 * 2**-7.4
    hump = Modulation(points=((0, 0), (0.5, 1), (1, 0)))
    points = on_ball(np.linspace(0, length / 0.5, 5), 0)
    problem = pose(preparation, Stroke(points, Brush(0.6 * length, 0.002, modulation=hump)))
    assert resolution(problem).wanted == 7


def test_stripes_of_an_alpha_are_held_as_well_as_peaks_of_a_profile(preparation):
    """64 pixels across the stroke, white and black by fours: each as wide as an eighth radius."""
    row = bytes(255 * (number // 4 % 2) for number in range(64))
    brush = Brush(0.1, 0.002, alpha=Alpha(pixels=row * 64))
    found = resolution(pose(preparation, arc(brush)))
    stripe = 0.1 * 2 / 16
    assert 2**-found.wanted < 0.75 * stripe
    assert 2**-found.wanted > stripe / 8


def test_copies_share_the_budget(preparation):
    """A stroke that is solved as fine as it asks for alone, and 64 of it, which do not overlap."""
    alone = Stroke(on_ball(0.0, np.linspace(-1.2, 1.2, 12)), Brush(0.01, 0.003))
    one, many = (
        resolution(pose(preparation, replace(alone, radial=(1, 1, count)))) for count in (1, 64)
    )
    assert one.level == one.wanted == many.wanted > many.level
    assert many.is_limited


@pytest.mark.parametrize("pressed", [5.0, 0.2])
def test_pressure_counts_as_what_it_draws(preparation, pressed):
    """A radius and a height are the same whatever part of them is pressure."""
    drawn = Stroke(POLE, Brush(0.02, 0.1))
    wanted = resolution(pose(preparation, drawn))
    factor = np.array([pressed])
    for same in (
        Stroke(POLE, Brush(0.02, 0.1 / pressed), intensity_factors=factor),
        Stroke(POLE, Brush(0.02 / pressed, 0.1), radius_factors=factor),
    ):
        assert resolution(pose(preparation, same)) == wanted
