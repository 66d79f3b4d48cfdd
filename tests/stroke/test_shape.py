# SPDX-License-Identifier: GPL-3.0-or-later
"""Profiles and modulations against numbers worked out by hand and scipy's Hermite spline."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.shape import MOST_NUMBERS

PRESETS = [
    ((-1, 0), (0, 1), (1, 0)),
    ((-1, 0), (-0.5, 1), (0.5, -1), (1, 0)),
    ((-1, 0), (-0.6, -0.25), (0, 1), (0.6, -0.25), (1, 0)),
    ((-1, 0), (-0.75, 1), (-0.25, -1), (0.25, 1), (0.75, -1), (1, 0)),
]
ALL = [
    *[Profile(name) for name in Profile.FORMULAS],
    *[Profile(points=points) for points in PRESETS],
    *[Modulation(name) for name in Modulation.FORMULAS],
    Modulation(points=((0, 1), (0.2, 0.1), (1, 2))),
]


@st.composite
def control_points(draw, low=-1.0, high=1.0, reach=10.0):
    """Any control points that go from left to right, values far outside the range included."""
    gaps = draw(st.lists(st.floats(1e-3, 1), min_size=2, max_size=10))
    x = np.cumsum(gaps)
    x = low + (high - low) * (x - x[0]) / (x[-1] - x[0])
    y = draw(st.lists(st.floats(-reach, reach), min_size=len(x), max_size=len(x)))
    return tuple(zip(x.tolist(), y, strict=True))


@pytest.mark.parametrize(
    ("name", "quarter", "half"),
    # 1 - t;  1 - 3 t^2 + 2 t^3;  1 - 10 t^3 + 15 t^4 - 6 t^5
    [("linear", 0.75, 0.5), ("cubic", 27 / 32, 0.5), ("quintic", 459 / 512, 0.5)],
)
def test_named_profiles(name, quarter, half):
    v = [0, 0.25, -0.25, 0.5, -0.5, 1, -1, 1.001, -7]
    expected = [1, quarter, quarter, half, half, 0, 0, 0, 0]
    np.testing.assert_allclose(Profile(name)(v), expected, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "start", "at_tenth", "middle", "end"),
    [
        ("identity", 1, 1, 1, 1),
        ("linear", 1, 0.9, 0.5, 0),
        ("exponential", 1, 0.5488116360940264, 0.049787068367863944, 0.0024787521766663585),
        ("central", 0.22313016014842982, 0.38289288597511206, 1, 0.22313016014842982),
        ("inverse_central", 0.7768698398515702, 0.6171071140248879, 0, 0.7768698398515702),
        # 1 + sin(-5), 1 + sin(-4), 1, 1 + sin 5
        ("sinusoidal", 1.9589242746631386, 1.7568024953079282, 1, 0.04107572533686143),
    ],
)
def test_named_modulations(name, start, at_tenth, middle, end):
    values = Modulation(name)([0, 0.1, 0.5, 1])
    np.testing.assert_allclose(values, [start, at_tenth, middle, end], atol=1e-12)


@pytest.mark.parametrize("shape", [Profile("cubic"), Profile("quintic"), *ALL[3:]])
def test_shapes_are_continuously_differentiable(shape):
    low, high = shape.DOMAIN
    h = 1e-5
    x = np.sort(np.append(np.linspace(low + 0.01, high - 0.01, 401), [p for p, _ in shape.points]))
    x = x[(x > low + 2 * h) & (x < high - 2 * h)]
    left, right = shape(x) - shape(x - h), shape(x + h) - shape(x)
    np.testing.assert_allclose(left / h, right / h, atol=0.02)
    assert np.abs(left).max() < 50 * h


@pytest.mark.parametrize("name", ["cubic", "quintic"])
def test_falloffs_end_without_a_crease(name):
    h = 1e-6
    assert abs(Profile(name)(1 - h)) < 10 * h**2
    assert abs(Profile(name)(h) - 1) < 10 * h**2


def test_control_points_make_a_catmull_rom_spline():
    points = ((-1, 0), (-0.5, 0.2), (0, 0.5), (0.6, 0.3), (1, 0))
    slopes = [0.4, 0.5, 0.1 / 1.1, -0.5, -0.75]  # (y2 - y0) / (x2 - x0); one-sided at the ends
    expected = CubicHermiteSpline(*np.array(points).T, slopes)
    v = np.linspace(-1, 1, 301)
    np.testing.assert_allclose(Profile(points=points)(v), expected(v), atol=1e-12)


def test_the_bump_preset_by_hand():
    # Slopes 1, 0, -1 through (-1, 0), (0, 1), (1, 0): at -1/2, (1/2)(1) + (1/8)(1) = 5/8.
    np.testing.assert_allclose(Profile(points=PRESETS[0])([-0.5, 0, 0.5]), [0.625, 1, 0.625])


@given(control_points())
def test_profiles_stay_in_range_and_meet_their_points(points):
    profile = Profile(points=points)
    b = profile(np.linspace(-1, 1, 2001))
    assert b.min() >= -1 - 1e-12
    assert b.max() <= 1 + 1e-12
    x, y = np.array(points).T
    np.testing.assert_allclose(profile(x), np.clip(y, -1, 1), atol=1e-9)


@given(control_points(0, 1))
def test_modulations_stay_in_range(points):
    m = Modulation(points=points)(np.linspace(0, 1, 2001))
    assert np.abs(m).max() <= 2 + 1e-12


@given(control_points())
def test_a_mirrored_profile_is_read_from_the_other_side(points):
    v = np.linspace(-1.2, 1.2, 241)
    profile = Profile(points=points)
    np.testing.assert_allclose(profile.mirrored()(v), profile(-v), atol=1e-9)
    assert profile.mirrored().mirrored() == profile


def test_mirrored_tables_and_names():
    table = Profile(table=(0, 0.5, -1, 0.25))
    v = np.linspace(-1, 1, 13)
    np.testing.assert_allclose(table.mirrored()(v), table(-v), atol=1e-12)
    assert Profile("quintic").mirrored() == Profile("quintic")


def test_tables_are_uniform_over_the_domain_and_joined_by_lines():
    np.testing.assert_allclose(Profile(table=(0, 1, 0))([-0.5, 0, 0.25]), [0.5, 1, 0.75])
    np.testing.assert_allclose(
        Modulation(table=(0, 1, 0.5))([0, 0.25, 0.75, 1]), [0, 0.5, 0.75, 0.5]
    )
    np.testing.assert_allclose(Profile(table=(5, -5))([-1, 1]), [1, -1])  # clamped


def test_outside_the_domain_a_modulation_keeps_its_end_and_a_profile_is_zero():
    np.testing.assert_allclose(Modulation("linear")([-0.5, 1.5]), [1, 0])
    np.testing.assert_allclose(Profile(table=(1, 1))([-1.01, -1, 1, 1.01]), [0, 1, 1, 0])


def test_shapes_keep_the_shape_of_their_argument():
    assert Profile("linear")(np.zeros((3, 4, 5))).shape == (3, 4, 5)
    assert Modulation("identity")(0.5).shape == ()


@pytest.mark.parametrize("shape", ALL)
def test_json_round_trip(shape):
    assert type(shape).from_json(shape.to_json()) == shape


@pytest.mark.parametrize(
    "data",
    [
        *(None, 3, "quintic", [], {}, {"name": "quintic", "table": [0, 1]}, {"form": "quintic"}),
        *({"name": "gaussian"}, {"name": 5}, {"name": ""}, {"name": None}),
        *({"points": []}, {"points": [[0, 0]]}, {"points": 5}, {"points": [[0, 1, 2], [1, 1, 1]]}),
        *({"points": [[1, 0], [0, 1]]}, {"points": [[0, 0], [0, 1]]}, {"points": "ab"}),
        *({"points": [[0, 0], [1, float("nan")]]}, {"points": [[0, 0], [1, None]]}),
        *({"table": []}, {"table": [1]}, {"table": [0, float("inf")]}, {"table": [0, 10**400]}),
        *({"table": "0123"}, {"table": ["0", "1"]}, {"points": ["01", "12"]}, {"table": {"0": 1}}),
        *(
            {"table": [0] * (MOST_NUMBERS + 1)},
            {"table": [[0, 1], [1, 0]]},
            {"table": [True, False]},
        ),
    ],
)
@pytest.mark.parametrize("kind", [Profile, Modulation])
def test_bad_shapes_are_refused(kind, data):
    with pytest.raises(SculptError, match=kind.WORD):
        kind.from_json(data)


@pytest.mark.parametrize("radius", [0, -0.1, 1.01, float("nan"), float("inf")])
def test_bad_radii_are_refused(radius):
    with pytest.raises(SculptError, match="radius"):
        Brush(radius, 0.1)


@pytest.mark.parametrize("intensity", [-1.01, 1.01, float("nan"), float("-inf")])
def test_bad_intensities_are_refused(intensity):
    with pytest.raises(SculptError, match="intensity"):
        Brush(0.1, intensity)
