# SPDX-License-Identifier: GPL-3.0-or-later
"""Replays: the visible lines of a history applied to its base. What is remembered of them is not
computed again.

    entries: [{"stroke": object | null, "layer": ID | null, "context": str | null, "strength": s}]

The local solver gives each line a layer (see field.edit.layers). Strokes that change the network
have no layers: they are applied one after another, and the result of each is remembered by the
field that it was applied to.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.errors import SculptError
from ...common.progress import Progress, sub_progress
from ...stroke.stroke import Stroke
from .payload import Payload, as_array, read
from .store import Store, read_strength

if TYPE_CHECKING:
    from ...field.edit.layers import Entry, Layer, State

    Replayed = tuple[State, dict[str, Any], dict[str, np.ndarray]]


def replay(store: Store, job: Payload, progress: Progress) -> "Replayed":
    """base, entries, solver -> the state and, of the local solver, layers <layer.N of each line N
    whose layer is another one now>; of another one base <field>.

    SculptError that names the stroke which cannot be applied where it stands now.
    """
    from ...field.edit.edit import Solver

    entries = read(job, "entries", list)
    if not all(isinstance(entry, dict) for entry in entries):
        raise SculptError("The job's entries must be objects.")
    solver = read(job, "solver", str)
    if solver == Solver.LOCAL:
        return _layers(store, job, entries, progress)
    strokes = [Stroke.from_json(entry.get("stroke")) for entry in entries]
    state = _network(store, job, strokes, solver, progress)
    name, data = store.keep_base(state.preparation.field)
    return state, {"base": name}, {"field": as_array(data)}


def result_key(base: str, stroke: Stroke, solver: str) -> str:
    """The name of what a solver that changes the network makes of a base."""
    from ...field.edit.layers import digest, stroke_key

    return digest(f"{base} {solver} {stroke_key(stroke)}".encode())


def _layers(
    store: Store, job: Payload, entries: Sequence[dict[str, Any]], progress: Progress
) -> "Replayed":
    from ...field.edit.layers import Term, replay

    names = [entry["layer"] for entry in entries if entry.get("layer") is not None]
    base, layers = store.load(job, job.fields.get("base"), names)
    by_name = {layer.id: layer for layer in layers}
    history = [_read_entry(entry, by_name.get(entry.get("layer", ""))) for entry in entries]
    terms = [Term(entry.solved.layer, entry.strength) for entry in history if entry.solved]
    known = store.made(base, terms, sub_progress(progress, 0.0, 0.1))
    state, found = replay(known, history, store.memo, sub_progress(progress, 0.1, 1.0))
    arrays = {
        f"layer.{number}": as_array(solved.layer.data)
        for number, (entry, solved) in enumerate(zip(entries, found, strict=True))
        if entry.get("layer") != solved.layer.id
    }
    layers = [{"id": solved.layer.id, "context": solved.context} for solved in found]
    return state, {"layers": layers}, arrays


def _read_entry(entry: dict[str, Any], layer: "Layer | None") -> "Entry":
    """A line of the history with its layer, where it has one."""
    from ...field.edit.layers import Entry, Solved

    stroke = entry.get("stroke")
    return Entry(
        None if stroke is None else Stroke.from_json(stroke),
        None if layer is None else Solved(layer, str(entry.get("context"))),
        read_strength(entry.get("strength")),
    )


def _network(
    store: Store, job: Payload, strokes: Sequence[Stroke], solver: str, progress: Progress
) -> "State":
    from ...field.edit.edit import sculpt
    from ...field.edit.layers import naming, numbered

    base, _ = store.load(job, job.fields.get("base"), ())
    done, state = 0, None
    while done < len(strokes):
        key = result_key(state.base if state else base[0], strokes[done], solver)
        if key not in store.results:
            break
        done, state = done + 1, store.results[key]
    state = state or store.made(base, (), progress)
    for number, stroke in enumerate(strokes[done:], done):
        share = numbered(progress, number, len(strokes))
        with naming(stroke, number):
            edit = sculpt(state.preparation, stroke, solver=solver, progress=share)
        key = result_key(state.base, stroke, solver)
        state, _ = store.new_base(edit.preparation)
        store.results[key] = state
    return state
