# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of one stroke and of several, their reports, and how they end early."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.field.edit.edit import Solver, edit, sculpt
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.problem.prepare import SURFACE_SAMPLES
from neural_sculpt_addon.field.problem.tube import COLUMNS, ROWS
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.field.threads import PIECE
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.mask import Mask
from neural_sculpt_addon.stroke.stroke import Kind, Stroke

MEASURES = {
    *("stroke", "solver", "seconds", "levels", "limited", "widths", "height", "gain", "outside"),
    *(
        f"{word}_{measure}"
        for word in ("tube", "cap", "reverse")
        for measure in ("mean", "p95", "max")
    ),
    *("rim_mean", "drift_mean", "drift_p99", "drift_max", "normal_deg", "gradient"),
    *("untouched_normal_rms", "untouched_normal_max", "untouched_worst"),
    *("components_before", "components_after", "tolerance", "tolerance_met"),
}


def arc(latitude, name="", radius=0.5, **words):
    turn = np.linspace(0, 1, 6)
    flat = radius * np.cos(latitude)
    points = [flat * np.cos(turn), flat * np.sin(turn), 0 * turn + radius * np.sin(latitude)]
    return Stroke(np.stack(points, axis=1), Brush(0.1, 0.03), name=name, **words)


def same(first, second):
    """Whether two fields are the same to the bit."""
    one, other = first.detail.coefficients, second.detail.coefficients
    return (
        all(map(torch.equal, first.network.parameters, second.network.parameters))
        and one.keys() == other.keys()
        and all(np.array_equal(one[k].index, other[k].index) for k in one)
        and all(np.array_equal(one[k].values, other[k].values) for k in one)
    )


@pytest.mark.parametrize("solver", [Solver.LOCAL, Solver.PAPER])
def test_strokes_are_applied_one_after_another(preparation, solver):
    words = {"solver": solver, "epochs": 1 if solver is Solver.PAPER else None}
    strokes = arc(0.0, "first"), arc(0.3, "second", seed=3)
    field, reports = edit(preparation.field, strokes, **words)
    first = sculpt(preparation, strokes[0], **words)
    second = sculpt(first.preparation, strokes[1], **words)
    assert same(field, second.field)
    assert not same(field, first.field)
    assert [report["stroke"] for report in reports] == ["first", "second"]
    for report, alone in zip(reports, (first, second), strict=True):
        assert set(report) == MEASURES
        assert {**report, "seconds": 0} == {**alone.report(), "seconds": 0}
    assert json.loads(json.dumps(reports, allow_nan=False)) == list(reports)


def test_an_edit_is_what_the_next_stroke_needs(preparation):
    """Field, layer, proxy: a new extraction finds the same cells and triangles."""
    done = sculpt(preparation, arc(0.2))
    assert done.solver is Solver.LOCAL and done.problem.preparation is preparation
    assert same(done.field, preparation.field.plus(done.layer))
    expected = extract(done.field, done.proxy.active.cells)
    np.testing.assert_array_equal(done.proxy.active.index, expected.active.index)
    np.testing.assert_array_equal(done.proxy.triangles, expected.triangles)
    after = done.preparation
    assert after.field is done.field and after.proxy is done.proxy
    assert np.linalg.norm(after.surface.points, axis=1).max() == pytest.approx(0.53, abs=1e-3)


def test_no_strokes_change_nothing(preparation):
    assert edit(preparation.field, []) == (preparation.field, ())


@pytest.mark.parametrize("solver", [Solver.LOCAL, Solver.NETWORK])
def test_mirrored_strokes(ready, solver):
    """Without an edit the error is the mean displacement, a little under 0.03 / 2."""
    before = [p.clone() for p in ready.field.network.parameters]
    stroke = arc(0.5, radius=0.6, mirror=frozenset("Z"))
    done = sculpt(ready, stroke, solver=solver)
    report = done.report()
    assert report["solver"] == solver.value
    assert report["tube_mean"] < (1e-4 if solver is Solver.LOCAL else 5e-3)
    assert report["drift_mean"] < (1e-5 if solver is Solver.LOCAL else 3e-3)
    assert report["tolerance_met"] or solver is not Solver.LOCAL
    assert all(map(torch.equal, before, ready.field.network.parameters))
    assert (done.layer is None) == (solver is Solver.NETWORK)
    for latitude in (0.5, -0.5):
        top = (1 + 0.03 / 0.6) * arc(latitude, radius=0.6).points[3]
        assert find_surface(done.field, [top]).distance[0] < 0.01


@pytest.mark.parametrize("solver", [Solver.NETWORK, Solver.PAPER])
def test_only_the_local_solver_sculpts_a_field_with_detail(preparation, solver):
    done = sculpt(preparation, arc(0.2))
    with pytest.raises(SculptError, match="Consolidate"):
        sculpt(done.preparation, arc(0.2), solver=solver)


def test_the_chamfer_distance_is_reported_when_asked_for(preparation):
    report = sculpt(preparation, arc(0.0)).report(chamfer=True)
    assert set(report) == MEASURES | {"chamfer", "chamfer_floor"}
    assert report["chamfer"] == pytest.approx(report["chamfer_floor"], rel=0.02)


@pytest.mark.parametrize("solver", [Solver.LOCAL, Solver.PAPER])
def test_progress_rises_over_all_strokes(preparation, solver):
    """Reports are measured in between."""
    seen = []
    edit(
        preparation.field,
        [arc(0.0), arc(0.5)],
        solver=solver,
        epochs=1 if solver is Solver.PAPER else None,
        progress=lambda fraction, message: seen.append((fraction, message)),
    )
    fractions = [fraction for fraction, _ in seen]
    assert fractions == sorted(fractions)
    assert fractions[0] == 0
    assert 0.9 < fractions[-1] <= 1
    assert all(message for _, message in seen)


@pytest.mark.parametrize("last", [0, 30, 300])
def test_cancelling_anywhere(preparation, last):
    calls = 0

    def progress(fraction, message):
        nonlocal calls
        calls += 1
        if calls > last:
            raise Cancelled

    with pytest.raises(Cancelled):
        edit(preparation.field, [arc(0.0)] * 3, progress=progress)
    assert calls == last + 1


def test_a_report_tells_who_asked_for_it_and_hears_a_cancel(preparation):
    """Before each piece of its samples; whoever asked for the edit is not told any more."""
    told, measured = [], []
    done = sculpt(preparation, arc(0.0), progress=lambda *news: told.append(news))
    before = len(told)
    done.report(progress=lambda *news: measured.append(news))
    assert len(told) == before
    assert {message for _, message in measured} == {"Measuring"}
    assert len(measured) > (SURFACE_SAMPLES + 2 * ROWS * COLUMNS) / PIECE / 2

    def cancel(fraction, message):
        raise Cancelled

    with pytest.raises(Cancelled):
        done.report(progress=cancel)


def test_a_stroke_off_the_surface_ends_the_edit(preparation):
    away = Stroke(np.array([[0.8, 0, 0], [0.8, 0.1, 0]]), Brush(0.05, 0.03))
    with pytest.raises(SculptError, match="off the surface"):
        sculpt(preparation, away)


@pytest.mark.parametrize(
    ("words", "match"),
    [
        ({"solver": "newton"}, "no solver 'newton'"),
        ({"solver": "paper", "epochs": 0}, "epochs"),
        ({"solver": "local", "epochs": 5}, "epochs"),
    ],
)
def test_bad_choices(preparation, words, match):
    with pytest.raises(SculptError, match=match):
        sculpt(preparation, arc(0.0), **words)
    with pytest.raises(SculptError, match=match):
        edit(preparation.field, [], **words)


@pytest.mark.parametrize(("kind", "strength"), [(Kind.DRAW, 0.05), (Kind.SMOOTH, 1.0)])
def test_the_masked_half_of_a_sphere_stays_and_the_other_is_as_without_a_mask(
    ready, kind, strength
):
    """The stroke runs along the equator; what lies to the right of x = 0 is masked."""
    turn = np.linspace(0.5, np.pi - 0.5, 9)
    points = 0.6 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    if kind is Kind.SMOOTH:  # something to smooth
        ridge = Stroke(points, Brush(0.04, 0.02))
        ready = sculpt(ready, ridge).preparation
    vertices, spacing = ready.proxy.vertices, 1 / 64
    mask = Mask.of(vertices, vertices[:, 0] > 0, spacing)
    free = Stroke(points, Brush(0.12, strength), kind=kind)
    whole = sculpt(ready, free)
    masked = sculpt(ready, replace(free, mask=mask))
    before, after = ready.surface.points, find_surface(masked.field, ready.surface.points)
    near = np.linalg.norm(before - [0, 0.6, 0], axis=1) < 0.5
    x = before[:, 0]
    assert after.distance[near & (x > 8 * spacing)].max() < 1e-6  # as anywhere else
    assert after.distance[near & (x > spacing)].max() < 5e-4  # beside a cliff as high as the stroke
    assert after.distance[near & (x > 0)].mean() < 3e-5
    assert after.distance[near & (x < -4 * spacing)].max() > 0.008
    other = whole.preparation.proxy.vertices
    left = (np.linalg.norm(other - [0, 0.6, 0], axis=1) < 0.5) & (other[:, 0] < -4 * spacing)
    apart = find_surface(masked.field, other[left]).distance
    assert apart.max() < 1e-3
    assert apart.mean() < 5e-5
    report = masked.report()
    assert report["tolerance_met"]
    assert report["gain"] == pytest.approx(1, abs=0.01)
    assert report["drift_mean"] < 1e-6
    assert report["untouched_normal_rms"] < 0.02


def test_a_stroke_whose_mask_leaves_nothing_is_refused(preparation):
    points = preparation.proxy.vertices
    mask = Mask.of(points, np.ones(len(points)), 1 / 32)
    with pytest.raises(SculptError, match="a mask keeps all of it"):
        sculpt(preparation, arc(0.0, mask=mask))
    with pytest.raises(SculptError, match="a mask keeps it"):
        sculpt(preparation, arc(0.0, mask=mask, kind=Kind.SMOOTH))
