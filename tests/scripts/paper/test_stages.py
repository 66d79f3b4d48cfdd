# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages are timed once, by whoever began first, and drawn to scale; an epoch has the paper's."""

import types

import numpy as np
import pytest
from paper.edits import random_edit
from paper.figures.gantt import COLOURS, LEFT, TOP, gantt
from paper.measures.stages import Span, Stopwatch, watching
from paper.methods.published import PAPER, Published
from paper.tables.table4 import STAGES

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import Preparation


def test_a_stage_within_another_is_part_of_that():
    watch = Stopwatch()
    with watch.stage("outer"), watch.stage("inner"):
        pass
    with watch.stage("after"):
        pass
    assert [span.stage for span in watch.spans] == ["outer", "after"]
    assert watch.spans[0].end <= watch.spans[1].start


def test_totals_are_sums_of_spans():
    watch = Stopwatch([Span("a", 0.0, 1.0), Span("b", 1.0, 1.5), Span("a", 2.0, 4.0)])
    assert watch.totals() == {"a": 3.0, "b": 0.5}


def test_functions_run_under_the_stopwatch_and_are_put_back():
    owner = types.ModuleType("owner")
    owner.double = function = lambda x: 2 * x
    with watching({(owner, "double"): "doubling"}) as watch:
        assert owner.double(4) == 8
    assert owner.double is function
    assert [span.stage for span in watch.spans] == ["doubling"]


def test_bars_are_as_long_as_spans():
    """Of 4 seconds the first stage takes 1, and the second 2 after a pause."""
    picture = gantt("A & B", [Span("a", 0, 1), Span("b", 2, 4)])
    (left, first), (right, second) = (
        (np.argmax(drawn), np.count_nonzero(drawn))
        for color in COLOURS[:2]
        for drawn in [(picture == color).all(axis=2).any(axis=0)]
    )
    assert second == pytest.approx(2 * first, abs=2)
    assert right - left == pytest.approx(2 * first, abs=2)
    assert (picture[:TOP, :LEFT] < 128).any(), "the title"


def test_every_named_stage_of_an_edit_is_timed():
    """But for finer rows, which this stroke does not need."""
    shape = primitive("sphere")
    preparation = Preparation(shape, extract(shape, 64))
    stroke = random_edit(preparation, 0, 1)
    found = set()
    for solver in ("local", "network"):
        with watching(STAGES) as watch:
            sculpt(preparation, stroke, solver=solver)
        found |= set(watch.totals())
    assert found >= set(STAGES.values()) - {"finer rows"}


def test_an_epoch_as_published_has_the_stages_of_the_paper_and_learns():
    shape = primitive("sphere")
    preparation = Preparation(shape, extract(shape, 64))
    problem = pose(preparation, random_edit(preparation, 0, 1))
    method = Published(problem)
    targets = np.concatenate([tube.target.points for tube in problem.tubes(20, 20)])
    before = np.abs(values(shape, targets)).mean()
    for _ in range(4):
        watch = Stopwatch()
        method.epoch(watch)
    assert set(watch.totals()) == set(PAPER)
    assert np.abs(values(method.field, targets)).mean() < 0.95 * before
