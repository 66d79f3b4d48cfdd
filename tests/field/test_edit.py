# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of several strokes, their reports, and how they end early."""

import json

import numpy as np
import pytest
import torch

from neural_sculpt_addon.field.edit import SOLVERS, edit
from neural_sculpt_addon.field.metrics import find_surface
from neural_sculpt_addon.field.prepare import SURFACE_SAMPLES
from neural_sculpt_addon.field.threads import PIECE
from neural_sculpt_addon.field.tube import COLUMNS, ROWS
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.errors import Cancelled, SculptError
from neural_sculpt_addon.stroke.progress import silent
from neural_sculpt_addon.stroke.stroke import Stroke

MEASURES = {
    *("tolerance_met", "widths"),
    *(
        f"{word}_{measure}"
        for word in ("tube", "cap", "reverse")
        for measure in ("mean", "p95", "max")
    ),
    *("rim_mean", "drift_mean", "drift_p99", "drift_max", "normal_deg", "gradient"),
    *("components_before", "components_after", "stroke", "solver", "seconds"),
}


def arc(latitude, name="", radius=0.5, **words):
    turn = np.linspace(0, 1, 6)
    flat = radius * np.cos(latitude)
    points = [flat * np.cos(turn), flat * np.sin(turn), 0 * turn + radius * np.sin(latitude)]
    return Stroke(np.stack(points, axis=1), Brush(0.1, 0.03), name=name, **words)


def test_strokes_are_applied_one_after_another(preparation):
    first, second = arc(0.0, "first"), arc(0.8, "second", seed=3)
    network = preparation.network
    both = edit(network, [first, second], solver="paper", epochs=2)
    halfway = edit(network, [first], solver="paper", epochs=2)
    end = edit(halfway.network, [second], solver="paper", epochs=2, preparation=halfway.preparation)
    assert all(map(torch.equal, both.network.parameters, end.network.parameters))
    assert not torch.equal(both.network.weights[0], halfway.network.weights[0])
    assert [report["stroke"] for report in both.reports] == ["first", "second"]
    for mine, alone in zip(both.reports, (*halfway.reports, *end.reports), strict=True):
        assert set(mine) == MEASURES
        assert {k: v for k, v in mine.items() if k != "seconds"} == {
            k: v for k, v in alone.items() if k != "seconds"
        }
    assert json.loads(json.dumps(both.reports, allow_nan=False)) == list(both.reports)


def test_a_preparation_changes_nothing_but_the_time(preparation):
    fresh = edit(preparation.network, [arc(0.0)], solver="paper", epochs=1)
    prepared = edit(
        preparation.network, [arc(0.0)], solver="paper", epochs=1, preparation=preparation
    )
    assert all(map(torch.equal, fresh.network.parameters, prepared.network.parameters))


def test_no_strokes_change_nothing(preparation):
    result = edit(preparation.network, [])
    assert result.network is preparation.network
    assert result.reports == ()


def test_the_last_stroke_is_shown_once_before_it_is_refined(ready):
    strokes = [arc(0.0, "first", 0.6), arc(0.8, "second", 0.6)]
    shown = []
    result = edit(ready.network, strokes, preparation=ready, quick=shown.append)
    (quick,) = shown
    assert [report["solver"] for report in quick.reports] == ["gauss_newton", "quick"]
    assert quick.reports[:1] == result.reports[:1]
    assert quick.reports[1]["seconds"] < result.reports[1]["seconds"]
    assert "tube_mean" not in quick.reports[1]
    again = edit(ready.network, strokes[:1], preparation=ready).preparation
    alone = edit(again.network, strokes[1:], solver="quick", preparation=again)
    assert all(map(torch.equal, quick.network.parameters, alone.network.parameters))


def test_a_cancelled_refinement_leaves_what_the_next_stroke_needs(ready):
    known, cancelled = [], False

    def progress(fraction, message):
        if cancelled:
            raise Cancelled

    def show(quick):
        nonlocal cancelled
        cancelled = True
        with pytest.raises(Cancelled):
            quick.remember(progress)
        known.append((quick, quick.remember(silent)))

    with pytest.raises(Cancelled):
        edit(
            ready.network, [arc(0.0, radius=0.6)], preparation=ready, quick=show, progress=progress
        )
    ((quick, preparation),) = known
    assert preparation.network is quick.network and preparation.proxy is quick.proxy
    before, after = ready.surface.points, preparation.surface.points
    far = np.linalg.norm(before[:, :2], axis=1) < 0.3  # from a stroke around the equator
    assert np.isin(before[far], after).all()
    lifted = np.linalg.norm(after, axis=1).max() - np.linalg.norm(before, axis=1).max()
    assert lifted == pytest.approx(0.03, abs=0.005)


@pytest.mark.parametrize("solver", sorted(set(SOLVERS) - {"paper"}))
def test_mirrored_strokes_by_every_solver(ready, solver):
    """Without an edit the error is the mean displacement, a little under 0.03 / 2."""
    before = [p.clone() for p in ready.network.parameters]
    stroke = arc(0.5, radius=0.6, mirror=frozenset("Z"))
    result = edit(ready.network, [stroke], solver=solver, preparation=ready)
    (report,) = result.reports
    assert report["solver"] == solver
    assert report["tube_mean"] < 0.005
    assert report["drift_mean"] < 0.003
    assert all(map(torch.equal, before, ready.network.parameters))
    for latitude in (0.5, -0.5):
        top = (1 + 0.03 / 0.6) * arc(latitude, radius=0.6).points[3]
        assert find_surface(result.network, [top]).distance[0] < 0.01


def test_the_chamfer_distance_is_reported_when_asked_for(preparation):
    (report,) = edit(
        preparation.network,
        [arc(0.0)],
        solver="paper",
        epochs=1,
        preparation=preparation,
        chamfer=True,
    ).reports
    assert set(report) == MEASURES | {"chamfer", "chamfer_floor"}
    assert report["chamfer"] > 0.99 * report["chamfer_floor"] > 0


def test_progress_rises_over_all_strokes(preparation):
    seen = []
    strokes = [arc(0.0), arc(0.5)]
    edit(
        preparation.network,
        strokes,
        solver="paper",
        epochs=3,
        progress=lambda fraction, message: seen.append((fraction, message)),
    )
    fractions = [fraction for fraction, _ in seen]
    assert fractions == sorted(fractions)
    assert fractions[0] == 0
    assert 0.9 < fractions[-1] <= 1
    assert all(message for _, message in seen)


@pytest.mark.parametrize("last", [0, 3, 30])
def test_cancelling_anywhere(preparation, last):
    calls = 0

    def progress(fraction, message):
        nonlocal calls
        calls += 1
        if calls > last:
            raise Cancelled

    with pytest.raises(Cancelled):
        edit(preparation.network, [arc(0.0)] * 3, solver="paper", epochs=20, progress=progress)
    assert calls == last + 1


def test_a_cancel_is_heard_while_an_edit_is_measured(ready):
    """Before each piece of the samples, which take some 15 ms."""
    messages = []
    edit(
        ready.network,
        [arc(0.0, radius=0.6)],
        solver="quick",
        preparation=ready,
        progress=lambda _, message: messages.append(message),
    )
    assert messages.count("Measuring") > (SURFACE_SAMPLES + 2 * ROWS * COLUMNS) / PIECE


def test_a_stroke_off_the_surface_ends_the_edit(preparation):
    away = Stroke(np.array([[0.8, 0, 0], [0.8, 0.1, 0]]), Brush(0.05, 0.03))
    with pytest.raises(SculptError, match="off the surface"):
        edit(preparation.network, [away], preparation=preparation)


@pytest.mark.parametrize(
    ("words", "match"),
    [
        ({"solver": "newton"}, "no solver 'newton'"),
        ({"solver": "paper", "epochs": 0}, "epochs"),
        ({"solver": "quick", "epochs": 5}, "epochs"),
    ],
)
def test_bad_choices(preparation, words, match):
    with pytest.raises(SculptError, match=match):
        edit(preparation.network, [arc(0.0)], **words)
