# SPDX-License-Identifier: GPL-3.0-or-later
"""Histories by layers: sums that are exact, and strokes solved again where they must be."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import torch

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.checkpoint import to_bytes
from neural_sculpt_addon.field.detail import Detail
from neural_sculpt_addon.field.edit.layers import (
    Entry,
    Layer,
    Solved,
    State,
    Term,
    context,
    digest,
    reached,
    replay,
    summed,
)
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import SUPPORT, UNIT, Level, cells_of, centres, linear, scaled
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.random_layers import random_layer

NORTH, BESIDE, SOUTH, EAST = (0, 0, 1), (0.15, 0, 1), (0, 0, -1), (1, 0, 0)


def dab(direction, radius=0.1, **words) -> Stroke:
    """On the sphere of radius 0.6."""
    direction = np.array(direction, float)
    return Stroke(
        np.array([0.6 * direction / np.linalg.norm(direction)]), Brush(radius, 0.04), **words
    )


@pytest.fixture(scope="module")
def base(ready) -> State:
    return State(digest(to_bytes(ready.field)), (), ready)


class Heard:
    """Which strokes of a replay were worked on."""

    def __init__(self) -> None:
        self.strokes: set[str] = set()

    def __call__(self, fraction: float, message: str) -> None:
        assert 0 <= fraction <= 1
        if message.startswith("Stroke "):
            self.strokes.add(message.partition(" of ")[0])


def units(*terms: tuple[Layer, float]) -> dict[tuple[int, int], int]:
    """The coefficients of a sum of layers in units, by level and node, as whole numbers."""
    total: Counter[tuple[int, int]] = Counter()
    for layer, strength in terms:
        for level, part in scaled(layer.coefficients, strength).items():
            for node, value in zip(part.index.tolist(), part.values.tolist(), strict=True):
                total[level, node] += round(value / UNIT)
    return {place: value for place, value in total.items() if value}


def units_of(state: State) -> dict[tuple[int, int], int]:
    return units((Layer("", b"", state.preparation.field.detail.coefficients), 1.0))


@pytest.fixture(scope="module")
def sculpted(base):
    """Three layers, of which the first two touch; what they were solved to; and the state."""
    memo = {}
    state, found = replay(base, [Entry(dab(at), None) for at in (NORTH, BESIDE, SOUTH)], memo)
    strokes = map(dab, (NORTH, BESIDE, SOUTH))
    return state, [Entry(*pair) for pair in zip(strokes, found, strict=True)], memo


@pytest.mark.parametrize("levels", [(3, 5), (4, 7), (6,)])
def test_a_support_is_where_the_layer_is_not_zero(levels):
    """Positive coefficients reach the middles of all fine cells of their supports."""
    random = np.random.default_rng(sum(levels))
    finest = 7
    coefficients = {}
    for level in levels:
        nodes = np.unique(linear(cells_of(random.uniform(0.1, 0.2, (6, 3)), level), level))
        coefficients[level] = Level(nodes, np.ones(len(nodes), np.float32))
    low, high = cells_of(np.array([[-0.2] * 3, [0.5] * 3]), finest)  # more than level 3 reaches
    axis = np.arange(low[0], high[0], dtype=np.int32)
    cells = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = centres(cells, finest)
    value = torch.zeros(len(points))
    Detail.of(coefficients).add_value(torch.from_numpy(points), value)
    reached = np.unique(linear(cells_of(points[value.numpy() > 0], SUPPORT), SUPPORT))
    np.testing.assert_array_equal(Layer.of(coefficients).support, reached)


def test_outside_of_the_cells_reached_two_sums_are_the_same(base):
    """Of layers moved, faded, muted and added, in other places each."""
    one, two, three, four = (Layer.of(random_layer(seed)) for seed in range(4))
    before = [Term(one, 1.0), Term(two, 1.0), Term(three, 0.0)]
    after = [Term(three, 0.0), Term(two, 0.5), Term(one, 1.0), Term(four, 1.0)]
    changed = reached(before, after)
    assert set(changed) == set(two.support) | set(four.support)
    points = np.random.default_rng(0).uniform(-1, 1, (60_000, 3)).astype(np.float32)
    away = ~np.isin(linear(cells_of(points, SUPPORT), SUPPORT), changed)
    sums = [values(summed(base.preparation.field, terms), points) for terms in (before, after)]
    np.testing.assert_array_equal(sums[0][away], sums[1][away])
    assert (sums[0][~away] != sums[1][~away]).mean() > 0.5
    assert not len(reached(before, before[::-1]))


def test_layers_touch_when_their_supports_do(base, sculpted):
    _, (north, beside, south), _ = sculpted
    terms = [Term(entry.solved.layer, 1.0) for entry in (north, beside, south)]
    for entry, touching in ((beside, terms[:1]), (south, [])):
        layer = entry.solved.layer
        assert entry.solved.context == context(base.base, touching, layer)
        assert entry.solved.context == context(
            base.base, [*touching, terms[0]._replace(strength=0.0)], layer
        )
        assert entry.solved.context != context("another", touching, layer)
        assert entry.solved.context != context(base.base, [Term(layer, 1.0)], layer)
    assert (
        context(base.base, [Term(terms[0].layer, 0.5)], beside.solved.layer)
        != beside.solved.context
    )


def test_a_field_is_the_sum_of_its_layers(sculpted):
    state, history, _ = sculpted
    assert units_of(state) == units(*((entry.solved.layer, 1.0) for entry in history))


@pytest.mark.parametrize("strength", [0.0, 0.37])
def test_what_no_layer_above_touches_needs_no_solution(sculpted, strength):
    state, (north, beside, south), _ = sculpted
    heard = Heard()
    changed = [north, replace(beside, strength=strength), replace(south, strength=strength)]
    after, found = replay(state, changed, {}, heard)
    assert not heard.strokes
    assert list(found) == [entry.solved for entry in changed]
    assert units_of(after) == units(*((entry.solved.layer, entry.strength) for entry in changed))


def test_only_what_touches_is_solved_again_and_comes_back_to_the_bit(sculpted):
    state, (north, beside, south), memo = sculpted
    heard = Heard()
    muted, found = replay(state, [beside, south], memo, heard)
    assert heard.strokes == {"Stroke 1"}
    assert found[0].layer.id != beside.solved.layer.id
    assert found[1] == south.solved
    alone = [replace(beside, solved=found[0]), south]
    heard = Heard()
    back, found = replay(muted, [north, *alone], memo, heard)
    assert not heard.strokes
    assert [each.layer.id for each in found] == [e.solved.layer.id for e in (north, beside, south)]
    assert units_of(back) == units_of(state)


def test_a_name_changes_nothing_and_a_brush_does(sculpted):
    state, (north, _, south), memo = sculpted
    renamed = Entry(replace(north.stroke, name="Nose"), None)
    assert replay(state, [renamed], memo)[1] == (north.solved,)
    wider = Entry(dab(NORTH, 0.12), None)
    heard = Heard()
    assert replay(state, [wider, south], memo, heard)[1][0].layer.id != north.solved.layer.id
    assert heard.strokes == {"Stroke 1"}


def test_absorbed_sculpting_keeps_its_coefficients(base, sculpted):
    state, (_, beside, south), memo = sculpted
    absorbed = Entry(None, beside.solved)
    after, found = replay(state, [absorbed, south], memo)
    assert found[0].layer is beside.solved.layer
    assert found[0].context == context(base.base, (), beside.solved.layer)
    assert units_of(after) == units((beside.solved.layer, 1.0), (south.solved.layer, 1.0))
    with pytest.raises(SculptError, match="missing"):
        replay(state, [Entry(None, None)], memo)


def test_the_stroke_that_cannot_be_applied_is_named(base):
    away = Stroke(np.array([[0.9, 0.0, 0.0]]), Brush(0.02, 0.03))
    with pytest.raises(SculptError, match=r"^Stroke 2: .* Nothing was changed\.$"):
        replay(base, [Entry(dab(NORTH), None), Entry(away, None)], {})
    with pytest.raises(SculptError, match=r"^Ear: "):
        replay(base, [Entry(replace(away, name="Ear"), None)], {})


@pytest.fixture(scope="module", params=["sphere", "torus"])
def model(request, base):
    """A base without layers, and places to sculpt it at."""
    if request.param == "sphere":
        return base, [dab(at) for at in (NORTH, BESIDE, SOUTH, EAST)]
    field = primitive("torus")
    points = [(0.7, 0.0, 0.0), (0.7, 0.1, 0.0), (-0.7, 0.0, 0.0), (0.0, 0.5, 0.2)]
    strokes = [Stroke(np.array([point]), Brush(0.1, 0.04)) for point in points]
    return State(digest(to_bytes(field)), (), prepare(field)), strokes


@pytest.mark.parametrize(
    "seed", [*range(3), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(3, 10))]
)
def test_whatever_is_done_the_field_is_the_sum_of_its_layers(model, seed):
    """Strokes, mutes, strengths, moves, deletions, undo, and files, in any order."""
    base, strokes = model
    random = np.random.default_rng(seed)
    memo, state, history, visible = {}, base, [], []
    known = [(history, visible)]
    for _ in range(14):
        history, visible = list(history), list(visible)
        some = int(random.integers(max(len(history), 1)))
        action = random.choice(["stroke", "mute", "strength", "move", "delete", "undo", "load"])
        if action == "undo":
            history, visible = known[int(random.integers(len(known)))]
        elif action == "stroke" or not history:
            history.append(Entry(strokes[int(random.integers(4))], None))
            visible.append(True)
        elif action == "mute":
            visible[some] = not visible[some]
        elif action == "strength":
            history[some] = replace(history[some], strength=float(random.choice([0, 0.4, 1])))
        elif action == "move":
            where = int(random.integers(len(history)))
            history.insert(where, history.pop(some))
            visible.insert(where, visible.pop(some))
        elif action == "delete":
            del history[some], visible[some]
        else:
            memo = {}
            history = [replace(e, solved=e.solved and read_back(e.solved)) for e in history]
            state = State.made(base.base, base.preparation.field, terms_of(history, visible))
        shown = [place for place, seen in enumerate(visible) if seen]
        state, found = replay(state, [history[place] for place in shown], memo)
        for place, solved in zip(shown, found, strict=True):
            history[place] = replace(history[place], solved=solved)
        terms = terms_of(history, visible)
        assert units_of(state) == units(*terms)
        for number, solved in enumerate(found):
            assert solved.context == context(base.base, terms[:number], solved.layer)
        known.append((history, visible))


def terms_of(history: list[Entry], visible: list[bool]) -> list[Term]:
    seen = [entry for entry, shown in zip(history, visible, strict=True) if shown]
    return [Term(entry.solved.layer, entry.strength) for entry in seen if entry.solved]


def read_back(solved: Solved) -> Solved:
    layer = Layer.read(solved.layer.data)
    assert layer.id == solved.layer.id
    return Solved(layer, solved.context)
