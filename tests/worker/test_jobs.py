# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs of the worker, called as the server calls them."""

import numpy as np
import pytest
import torch

from neural_sculpt_addon.field.checkpoint import from_bytes, to_bytes
from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.proxy import extract
from neural_sculpt_addon.stroke.errors import Cancelled
from neural_sculpt_addon.stroke.progress import silent
from neural_sculpt_addon.worker.jobs import Jobs
from neural_sculpt_addon.worker.payload import Payload, Task

CPU = torch.device("cpu")

RESOLUTION = 48


def task(fields, network, quick=lambda _: None):
    arrays = {"field": np.frombuffer(to_bytes(network), np.uint8)}
    return Task(fields, arrays, quick=quick, preview=lambda _: None, enough=lambda: False)


def edit_fields(tilt, solver, **revisions):
    angle = np.linspace(-0.5, 0.5, 9)
    points = 0.6 * np.stack([np.sin(angle), 0 * angle + tilt, np.cos(angle)], axis=1)
    stroke = {"points": points.tolist(), "radius": 0.15, "intensity": 0.08}
    return {"strokes": [stroke], "solver": solver, "resolution": RESOLUTION, **revisions}


@pytest.fixture(scope="module")
def edited():
    """The jobs after one stroke, and its result."""
    jobs = Jobs(CPU)
    fields = edit_fields(0.0, "quick", revision="a", result_revision="b")
    return jobs, jobs.edit(task(fields, primitive("sphere")), silent)


def network_of(result):
    return from_bytes(result.arrays["field"].tobytes())


def test_a_result_shows_the_field_as_if_from_nothing(edited):
    _, result = edited
    expected = extract(network_of(result), RESOLUTION)
    assert np.array_equal(result.arrays["vertices"], expected.vertices)
    assert np.array_equal(result.arrays["triangles"], expected.triangles)


def test_a_quick_result_at_another_resolution_follows_what_was_shown(edited):
    jobs, before = edited
    quick = []

    def show(result: Payload) -> None:
        quick.append(result)
        raise Cancelled

    revisions = {"revision": "b", "quick_revision": "c", "result_revision": "d"}
    job = task(edit_fields(0.1, "gauss_newton", **revisions), network_of(before), show)
    with pytest.raises(Cancelled):
        jobs.edit(job, silent)
    assert quick[0].fields["revision"] == "c"
    after = network_of(quick[0])
    vertices = quick[0].arrays["vertices"]
    value, gradient = values_and_gradients(after, vertices)
    assert np.mean(np.abs(value) / np.linalg.norm(gradient, axis=1)) < 1e-5
    expected = extract(after, RESOLUTION)
    assert len(vertices) == pytest.approx(len(expected.vertices), rel=0.01)
    assert not np.array_equal(vertices, expected.vertices[: len(vertices)])


def test_a_cancel_while_a_quick_result_is_remembered_changes_nothing_of_the_next_stroke(edited):
    """The next stroke knows what the last one asked for, not only what the network made of it."""
    _, before = edited
    revisions = {"revision": "b", "quick_revision": "c", "result_revision": "d"}
    first = edit_fields(0.1, "gauss_newton", **revisions)
    second = edit_fields(0.2, "quick", revision="c", result_revision="e")

    def run(message):
        """The second stroke, after the first was cancelled when it first said `message`."""
        jobs, quick = Jobs(CPU), []

        def progress(_, said):
            if quick and said == message:
                raise Cancelled

        with pytest.raises(Cancelled):
            jobs.edit(task(first, network_of(before), quick.append), progress)
        (shown,) = quick
        result = jobs.edit(task(second, network_of(shown)), silent)
        return result.arrays["field"], shown

    early, shown = run("Preparing")
    late, _ = run("Refining")
    assert np.array_equal(early, late)
    afresh = Jobs(CPU).edit(task(second, network_of(shown)), silent)
    assert not np.array_equal(early, afresh.arrays["field"])


def test_a_sampled_band_holds_the_field_near_the_surface():
    network = primitive("torus")
    band = Jobs(CPU).sample(task({"resolution": 40}, network), silent).arrays["band"]
    assert band.shape == (41, 41, 41) and band.dtype == np.float32
    axis = np.linspace(-1, 1, 41, dtype=np.float32)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    expected = np.clip(values(network, points), -0.15, 0.15)
    np.testing.assert_allclose(band.ravel(), expected, atol=1e-6)
