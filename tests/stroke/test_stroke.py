# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes and stroke files: round trips, mirror images, and everything that is no stroke."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.stroke.alpha import Alpha
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.file import dump_strokes, parse_strokes
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import MOST_POINTS, Direction, Ends, Kind, Stroke
from neural_sculpt_addon.stroke.symmetry import ONCE

POINTS = [[0, 0, 0.5], [0.1, 0, 0.5]]
PLAIN = {"points": POINTS, "radius": 0.08, "intensity": 0.06}

unit = st.floats(-1, 1)
tables = st.lists(unit, min_size=2, max_size=9).map(tuple)
names = st.sampled_from
profiles = st.one_of(
    names(list(Profile.FORMULAS)).map(Profile), tables.map(lambda t: Profile(table=t))
)
modulations = st.one_of(
    names(list(Modulation.FORMULAS)).map(Modulation),
    st.lists(unit, min_size=2, max_size=9).map(
        lambda y: Modulation(points=tuple((i / 10, v) for i, v in enumerate(y)))
    ),
)
alphas = st.none() | st.builds(
    Alpha,
    pixels=st.integers(2, 8).flatmap(lambda n: st.binary(min_size=n * n, max_size=n * n)),
    angle=st.floats(-360, 360),
    spacing=st.floats(0.25, 16),
    flipped=st.booleans(),
)
brushes = st.builds(Brush, st.floats(1e-3, 1), unit, profiles, modulations, alphas)


@st.composite
def strokes(draw):
    count = draw(st.integers(1, 8))
    factors = st.none() | arrays(float, count, elements=st.floats(0, 10))
    return Stroke(
        points=draw(arrays(float, (count, 3), elements=unit)),
        brush=draw(brushes),
        closed=draw(st.booleans()),
        radius_factors=draw(factors),
        intensity_factors=draw(factors),
        kind=draw(st.sampled_from(Kind)),
        ends=draw(st.sampled_from(Ends)),
        direction=draw(st.sampled_from(Direction)),
        mirror=draw(st.frozensets(st.sampled_from("XYZ"))),
        radial=draw(st.sampled_from([ONCE, (1, 1, 4), (2, 4, 1)])),  # none leaves the box
        name=draw(st.text(max_size=20)),
        seed=draw(st.integers(0, 2**63 - 1)),
    )


@given(st.lists(strokes(), max_size=3))
def test_files_round_trip_exactly(drawn):
    again = parse_strokes(dump_strokes(drawn))
    assert list(again) == drawn
    for ours, theirs in zip(again, drawn, strict=True):
        np.testing.assert_array_equal(ours.points, theirs.points)
        assert (ours.brush, ours.ends, ours.mirror) == (theirs.brush, theirs.ends, theirs.mirror)
        assert ours.radial == theirs.radial
        for word in ("radius_factors", "intensity_factors"):
            a, b = getattr(ours, word), getattr(theirs, word)
            assert (a is None) == (b is None)
            assert a is None or np.array_equal(a, b)


def test_the_documented_file_is_read():
    text = """{"version": 1, "strokes": [{"points": [[0, 0, 0.5], [0.1, 0, 0.5]], "radius": 0.08,
        "intensity": 0.06, "profile": {"points": [[-1, 0], [0, 1], [1, 0]]},
        "modulation": {"points": [[0, 1], [1, 0]]}}]}"""
    (stroke,) = parse_strokes(text)
    assert stroke.points.tolist() == POINTS
    assert stroke.brush == Brush(
        0.08,
        0.06,
        Profile(points=((-1, 0), (0, 1), (1, 0))),
        Modulation(points=((0, 1), (1, 0))),
    )
    assert (stroke.ends, stroke.direction) == (Ends.ROUND, Direction.SURFACE)
    assert (stroke.closed, stroke.mirror, stroke.name, stroke.seed) == (False, frozenset(), "", 0)
    assert stroke.radial == ONCE


def test_an_alpha_by_name_is_read():
    stroke = Stroke.from_json({**PLAIN, "alpha": {"name": "rivet", "spacing": 3, "angle": -20}})
    assert stroke.brush.alpha == Alpha("rivet", angle=-20, spacing=3)
    assert "alpha" not in Stroke.from_json(PLAIN).to_json()


def test_defaults_are_a_quintic_profile_and_no_modulation():
    brush = Stroke.from_json(PLAIN).brush
    assert brush == Brush(0.08, 0.06, Profile("quintic"), Modulation("identity"))


def test_strokes_compare_by_their_data():
    stroke = Stroke.from_json(PLAIN)
    assert stroke == Stroke.from_json(PLAIN)
    assert stroke != Stroke.from_json({**PLAIN, "seed": 1})
    assert stroke != Stroke.from_json({**PLAIN, "closed": True})
    assert stroke != "stroke"
    with pytest.raises(TypeError):
        hash(stroke)


BAD = {
    "no object": [None, 5, [], "stroke"],
    "a missing field": [{k: v for k, v in PLAIN.items() if k != word} for word in PLAIN],
    "an unknown field": [{**PLAIN, "pressure": 1}],
    "points": [
        {**PLAIN, "points": bad}
        for bad in (
            *([], [[]], [0, 0, 0.5], [[0, 0]], [[0, 0, 0, 0]], [[0, 0, 0], [0, 0]], "abc", None),
            *({"x": 1}, [[0, 0, float("nan")]], [[0, 0, float("inf")]], [[0, 0, 1.001]]),
            *([[0, 0, 10**400]], [["0", "0", "0"]], [[None, 0, 0]], [[[0, 0, 0]]], 7),
            *([[0, 0, 0.5]] * (MOST_POINTS + 1), [[False, True, False]]),
        )
    ],
    "numbers": [
        {**PLAIN, word: bad}
        for word in ("radius", "intensity")
        for bad in (float("nan"), float("inf"), "0.1", None, [0.1], 5, 10**400, True, {})
    ],
    "radii that no field resolves": [{**PLAIN, "radius": bad} for bad in (9e-4, 1e-6, 1e-30)],
    "shapes beyond all bounds": [
        {**PLAIN, word: shape}
        for word in ("profile", "modulation")
        for shape in (
            {"points": [[-1e308, 0], [1e308, 0]]},
            {"points": [[-1, 1e308], [1, -1e308]]},
            {"table": [1e308, -1e308]},
        )
    ],
    "long": [
        *({**PLAIN, word: {"name": "x" * 5000}} for word in ("profile", "modulation")),
        *({**PLAIN, word: "x" * 5000} for word in ("ends", "radius", "mirror")),
        {**PLAIN, "y" * 5000: 1},
        {**PLAIN, "seed": 10**4000},
    ],
    "factors": [
        {**PLAIN, word: bad}
        for word in ("radius_factors", "intensity_factors")
        for bad in ([1], [1, 1, 1], [1, -0.1], [1, 10.1], [1, float("nan")], 1, "12", [[1, 1]], {})
    ],
    "choices": [
        *({**PLAIN, "ends": bad} for bad in ("square", 1, None, ["round"])),
        *({**PLAIN, "direction": bad} for bad in ("up", 0, {})),
        *({**PLAIN, "mirror": bad} for bad in ("W", "x", 1, [1, "X"], [["X"]], {"X": 1}, None)),
        *(
            {**PLAIN, "radial": bad}
            for bad in (6, "Z", None, {"Z": 6}, [], [1, 1], [1, 1, 1, 1], [1, 1, 2.0], [1, 1, True])
        ),
        *({**PLAIN, "radial": bad} for bad in ([0, 1, 1], [1, 65, 1], [1, 1, 10**400], [64] * 3)),
        *({**PLAIN, "closed": bad} for bad in (1, 0, "yes", None)),
        *({**PLAIN, "name": bad} for bad in (5, None, ["a"], {})),
        *({**PLAIN, "seed": bad} for bad in (-1, 2**63, 1.5, "1", None, float("inf"), True)),
        *({**PLAIN, word: bad} for word in ("profile", "modulation") for bad in (None, "linear")),
        *({**PLAIN, "alpha": bad} for bad in (None, "scales", {"name": "fur"}, {"angle": 3})),
    ],
}


@pytest.mark.parametrize("data", BAD["long"])
def test_a_refusal_quotes_at_most_100_characters(data):
    with pytest.raises(SculptError) as caught:
        Stroke.from_json(data)
    assert len(str(caught.value)) < 250


def test_a_pressure_that_is_next_to_none_is_none():
    stroke = Stroke.from_json({**PLAIN, "radius_factors": [1e-300] * len(PLAIN["points"])})
    assert stroke.largest_factor == 0


@pytest.mark.parametrize("factors", [None, [0.5, 3.0, 0.0]])
def test_the_largest_radius_and_intensity_are_those_that_are_pressed(factors):
    most = 1 if factors is None else 3
    words = {} if factors is None else {"radius_factors": factors, "intensity_factors": factors}
    points = [[0, 0, 0.5], [0.1, 0, 0.5], [0.2, 0, 0.5]]
    stroke = Stroke.from_json(
        {**PLAIN, "points": points, "radius": 0.02, "intensity": -0.1, **words}
    )
    assert stroke.largest_radius == pytest.approx(most * 0.02)
    assert stroke.largest_intensity == pytest.approx(most * 0.1)


def test_the_least_radius_of_the_panel_is_a_stroke():
    assert Stroke.from_json({**PLAIN, "radius": float(np.float32(0.001))}).brush.radius > 0


@pytest.mark.parametrize("data", [data for group in BAD.values() for data in group])
def test_what_is_no_stroke_is_refused_in_one_sentence(data):
    with pytest.raises(SculptError) as caught:
        Stroke.from_json(data)
    assert len(str(caught.value)) < 300
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        *("", "stroke", "[]", "{}", "null", '{"version": 1}', '{"strokes": []}', '{"version": 1'),
        *('{"version": 1, "strokes": {}}', '{"version": "1", "strokes": []}', "[" * 100_000),
        '{"version": 1, "strokes": [{"points": [[0, 0, ' + "9" * 5000 + "]]}]}",
    ],
)
def test_what_is_no_stroke_file_is_refused(text):
    with pytest.raises(SculptError) as caught:
        parse_strokes(text)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("version", [2, 99])
def test_a_newer_file_is_refused_with_the_way_out(version):
    with pytest.raises(SculptError, match=f"version {version}.*Update Neural Sculpt"):
        parse_strokes(json.dumps({"version": version, "strokes": []}))


def test_the_message_names_the_stroke():
    text = json.dumps({"version": 1, "strokes": [PLAIN, {**PLAIN, "radius": -1}]})
    with pytest.raises(SculptError, match=r"Stroke 2: .*radius"):
        parse_strokes(text)


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
        max_leaves=8,
    ),
    st.sampled_from(
        [None, *PLAIN, "mirror", "radial", "seed", "name", "profile", "radius_factors"]
    ),
)
def test_any_json_is_a_stroke_or_a_sculpt_error(data, word):
    try:
        stroke = Stroke.from_json(data if word is None else {**PLAIN, word: data})
    except SculptError:
        return
    assert parse_strokes(dump_strokes([stroke])) == (stroke,)


def test_mirror_images():
    skew = Profile(points=((-1, 0), (-0.5, 1), (0.5, -1), (1, 0)))
    stroke = Stroke(np.array([[0.1, 0.2, 0.3]]), Brush(0.1, 0.1, skew), mirror=frozenset("XZ"))
    copies = stroke.copies()
    signs = [np.sign(copy.points[0]).tolist() for copy in copies]
    assert signs == [[1, 1, 1], [-1, 1, 1], [1, 1, -1], [-1, 1, -1]]
    assert [copy.brush.profile == skew for copy in copies] == [True, False, False, True]
    assert all(not copy.mirror for copy in copies)
    assert len(Stroke(stroke.points, stroke.brush, mirror=frozenset("XYZ")).copies()) == 8


def test_a_stroke_owns_its_points():
    points = np.zeros((2, 3))
    stroke = Stroke(points, Brush(0.1, 0.1))
    points[:] = 1
    assert stroke.points.max() == 0
