# SPDX-License-Identifier: GPL-3.0-or-later
"""Replays give what the strokes give one by one, and repeat nothing that is known."""

from dataclasses import dataclass, field
from typing import Any

import pytest
import torch

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.worker.protocol import JobKind
from neural_sculpt_addon.worker.server.jobs import Jobs
from neural_sculpt_addon.worker.server.payload import MissingError, Payload
from tests.worker.server.histories import Object, run, stroke

CPU = torch.device("cpu")

NORTH, BESIDE, EAST = stroke(), stroke(x=0.1), stroke(x=0.55)


@dataclass
class Heard:
    """Listens to progress: which strokes were worked on."""

    strokes: set[str] = field(default_factory=set)

    def __call__(self, fraction: float, message: str) -> None:
        assert 0 <= fraction <= 1
        if message.startswith("Stroke "):
            self.strokes.add(message.partition(":")[0])


def replay(
    jobs: Jobs, ob: Object, entries: list[dict[str, Any]], solver: str = "local"
) -> tuple[Payload, set[str]]:
    """The result, and which strokes were worked on."""
    heard = Heard()
    fields = {"base": ob.base, "entries": entries, "solver": solver, "resolution": 48}
    fields["result_revision"] = "replayed"
    return run(jobs, JobKind.REPLAY, fields, ob.bytes, heard), heard.strokes


def fresh(*strokes: dict[str, Any]) -> list[dict[str, Any]]:
    """Entries that have never been solved."""
    unknown = {"layer": None, "context": None, "strength": 1.0}
    return [{"stroke": each, **unknown} for each in strokes]


def names(result: Payload) -> list[str]:
    return [layer["id"] for layer in result.fields["layers"]]


@pytest.fixture(scope="module")
def sculpted():
    """Jobs and an object after three strokes, of which the first two touch."""
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    for each in (NORTH, BESIDE, EAST):
        ob.edit(jobs, each)
    return jobs, ob


def test_what_was_drawn_needs_no_replay(sculpted):
    jobs, ob = sculpted
    result, worked = replay(jobs, ob, ob.entries)
    assert not worked
    assert names(result) == [name for name, _ in ob.layers]
    assert not [name for name in result.arrays if name.startswith("layer.")]
    result, worked = replay(jobs, ob, fresh(NORTH, BESIDE, EAST))
    assert not worked
    assert names(result) == [name for name, _ in ob.layers]
    assert {name for name in result.arrays if "." in name} == {"layer.0", "layer.1", "layer.2"}
    assert (result.arrays["layer.1"] == ob.bytes[ob.layers[1][0]]).all()


def test_a_worker_that_knows_nothing_solves_all(sculpted):
    _, ob = sculpted
    result, worked = replay(Jobs(CPU), ob, fresh(NORTH, BESIDE, EAST))
    assert worked == {"Stroke 1 of 3", "Stroke 2 of 3", "Stroke 3 of 3"}
    assert names(result)[0] == ob.layers[0][0]


def test_a_layer_that_nothing_touches_is_muted_at_once(sculpted):
    jobs, ob = sculpted
    result, worked = replay(jobs, ob, ob.entries[:2])
    assert not worked
    faint = [*ob.entries[:2], ob.entries[2] | {"strength": 0.5}]
    result, worked = replay(jobs, ob, faint)
    assert not worked
    assert names(result) == [name for name, _ in ob.layers]


def test_only_what_touches_is_solved_again(sculpted):
    jobs, ob = sculpted
    result, worked = replay(jobs, ob, ob.entries[1:])
    assert worked == {"Stroke 1 of 2"}
    assert {name for name in result.arrays if "." in name} == {"layer.0"}
    back, worked = replay(jobs, ob, ob.entries)
    assert not worked
    assert names(back) == [name for name, _ in ob.layers]


def test_the_stroke_that_cannot_be_placed_is_named(sculpted):
    jobs, ob = sculpted
    away = {**stroke(), "points": [[0.9, 0.0, 0.0]], "radius": 0.02}
    for solver in ("local", "network"):
        with pytest.raises(SculptError, match=r"^Ear: .*Nothing was changed\.$"):
            replay(jobs, ob, fresh({**away, "name": "Ear"}), solver)


def test_a_missing_layer_is_named(sculpted):
    jobs, ob = sculpted
    unheard_of = ob.entries[0] | {"layer": "0" * 64}
    with pytest.raises(MissingError) as caught:
        replay(jobs, ob, [unheard_of])
    assert caught.value.ids == ["0" * 64]


@pytest.mark.parametrize("entries", [[1], [{}], [{"stroke": None, "layer": None, "strength": 1}]])
def test_entries_that_are_none_are_refused(sculpted, entries):
    jobs, ob = sculpted
    with pytest.raises(SculptError):
        replay(jobs, ob, entries)


@pytest.mark.long
def test_strokes_that_change_the_network_are_repeated_from_where_they_differ():
    jobs, ob = Jobs(CPU), Object(primitive("sphere"))
    wide = [stroke(radius=0.15), stroke(x=0.55, radius=0.15)]
    both, worked = replay(jobs, ob, fresh(*wide), "network")
    assert worked == {"Stroke 1 of 2", "Stroke 2 of 2"}
    again, worked = replay(jobs, ob, fresh(*wide), "network")
    assert not worked
    assert (again.arrays["field"] == both.arrays["field"]).all()
    other, worked = replay(jobs, ob, fresh(wide[0], NORTH), "network")
    assert worked == {"Stroke 2 of 2"}
    assert other.fields["base"] != both.fields["base"]
    none, worked = replay(jobs, ob, [], "network")
    assert not worked
    assert none.fields["base"] == ob.base
