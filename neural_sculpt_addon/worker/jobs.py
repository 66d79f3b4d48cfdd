# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker can do: one handler per kind of job, fields and arrays in, fields and arrays out.

Jobs name a field by its `state` (see store) and its `revision`. Torch and the rest are imported by
the job that needs them first, or by `warm_up`.
"""

from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, sub_progress
from ..stroke.stroke import Stroke
from .cache import Cache
from .payload import Handler, Payload, Task, as_array, proxy_arrays, read, read_array
from .protocol import JobKind
from .replay import replay_network, result_key
from .store import Store, read_strength, state_bytes

if TYPE_CHECKING:
    import torch

    from ..field.edit import Edit
    from ..field.field import Field
    from ..field.fit import Fit
    from ..field.layers import Memo, Solved, State
    from ..field.proxy import Proxy

PREVIEW_CELLS = 64
"""Of a proxy that is only looked at for a moment."""

EDITS, RESULTS, SOLUTIONS = 128 << 20, 128 << 20, 128 << 20
"""Bytes of edits that can still be measured, of fields that the network's solver made, and of
layers that strokes were solved to."""


def warm_up() -> None:
    """Import what the jobs need, so that the first one need not wait for it."""
    from ..field import absorb, checkpoint, fit, layers, primitives  # noqa: F401


class Jobs:
    """The handlers and what they remember."""

    def __init__(self, device: "torch.device") -> None:
        """Nothing is known yet; `device` is what strokes are sculpted on."""
        self._store = Store(device)
        self._memo: Memo = Cache(SOLUTIONS, _solved_bytes)
        self._results: Cache[str, State] = Cache(RESULTS, state_bytes)
        self._edits: Cache[str, Edit] = Cache(EDITS, _edit_bytes)
        self._shown: tuple[State, Proxy] | None = None

    def handlers(self) -> dict[JobKind, Handler]:
        """The handler of each kind of job."""
        return {
            JobKind.EDIT: self.edit,
            JobKind.REPLAY: self.replay,
            JobKind.MEASURE: self.measure,
            JobKind.MESH: self.mesh,
            JobKind.FIT: self.fit,
            JobKind.ABSORB: self.absorb,
            JobKind.LOAD: self.load,
            JobKind.SAVE: self.save,
            JobKind.SAMPLE: self.sample,
            JobKind.PREPARE: self.prepare,
        }

    def edit(self, job: Task, progress: Progress) -> Payload:
        """state, stroke, solver, resolution, result_revision -> revision, seconds, and

        of the local solver layer, context <layer, proxy>, of others base <field, proxy>.
        """
        from ..field.edit import Solver, sculpt

        before = self._store.state(job, sub_progress(progress, 0.0, 0.1))
        stroke = Stroke.from_json(read(job, "stroke", dict))
        solver, share = read(job, "solver", str), sub_progress(progress, 0.1, 0.9)
        if solver == Solver.LOCAL:
            state, solved, edit = before.sculpted(stroke, self._memo, share)
            fields, arrays = _layer(solved)
        else:
            edit = sculpt(before.preparation, stroke, solver=solver, progress=share)
            state, arrays = self._new_base(edit)
            fields = {"base": state.base}
            self._results[result_key(before.base, stroke, solver)] = state
        self._edits[read(job, "result_revision", str)] = edit
        return self._answer(state, {"seconds": edit.seconds, **fields}, arrays, job, progress)

    def replay(self, job: Task, progress: Progress) -> Payload:
        """base, entries, solver, resolution, result_revision -> revision, and

        of the local solver layers <proxy, layer.N of each new layer>, of others base <field, proxy>.
        """
        from ..field.edit import Solver
        from ..field.layers import Entry, Solved, Term, replay

        entries = read(job, "entries", list)
        if not all(isinstance(entry, dict) for entry in entries):
            raise SculptError("The job's entries must be objects.")
        known = [entry for entry in entries if entry.get("layer") is not None]
        base, found = self._store.load(job, read(job, "base", str), [e["layer"] for e in known])
        strokes = [_stroke(entry) for entry in entries]
        solver, share = read(job, "solver", str), sub_progress(progress, 0.0, 0.9)
        if solver != Solver.LOCAL:
            if None in strokes or known:
                raise SculptError(f"The solver {solver!r:.60} has no layers.")
            state = replay_network(
                base[0],
                lambda progress: self._store.made(base, (), progress),
                [stroke for stroke in strokes if stroke is not None],
                self._results,
                lambda edit: self._new_base(edit)[0],
                solver,
                share,
            )
            _, data = self._store.keep_base(state.preparation.field)
            return self._answer(state, {"base": state.base}, {"field": as_array(data)}, job, progress)
        solutions = iter(found)
        history = [
            Entry(
                stroke,
                Solved(next(solutions), str(entry.get("context"))) if entry in known else None,
                read_strength(entry.get("strength")),
            )
            for stroke, entry in zip(strokes, entries, strict=True)
        ]
        terms = [Term(e.solved.layer, e.strength) for e in history if e.solved]
        start = self._store.made(base, terms, sub_progress(share, 0.0, 0.1))
        state, solved = replay(start, history, self._memo, sub_progress(share, 0.1, 1.0))
        pairs = [(each.layer.id, each.context) for each in solved]
        arrays = {
            f"layer.{number}": as_array(each.layer.data)
            for number, (each, entry) in enumerate(zip(solved, entries, strict=True))
            if each.layer.id != entry.get("layer")
        }
        layers = [{"id": name, "context": context} for name, context in pairs]
        return self._answer(state, {"layers": layers}, arrays, job, progress)
