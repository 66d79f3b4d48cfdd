# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker can do: one handler per kind of job, fields and arrays in, fields and arrays out.

Jobs name a field by its `state` (see store) and its `revision`, and what shows it by `resolution`
and `triangles` (see shown). Torch and the rest are imported by the job that needs them first, or by
`warm_up`.
"""

import gc
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.errors import SculptError
from ...common.progress import Progress, sub_progress
from ...common.text import to_json
from ...stroke.stroke import Stroke
from ..answers import SNAPPED
from ..protocol import JobKind
from .cache import Cache
from .payload import Handler, Payload, Task, as_array, proxy_arrays, read, read_array, read_numbers
from .replay import replay, result_key
from .shown import ProxyMaker, refined
from .store import Store, preparation_bytes

if TYPE_CHECKING:
    import torch

    from ...field.edit.absorb import Absorbed
    from ...field.edit.boolean import Solid
    from ...field.edit.edit import Edit
    from ...field.edit.layers import Solved, State
    from ...field.field import Field
    from ...field.fit.fit import Fit
    from ...field.mesh.proxy import Proxy

PREVIEW_CELLS = 64
"""Of a proxy that is only looked at for a moment."""

EDITS = 128 << 20
"""Bytes of edits that can still be measured."""


def warm_up() -> None:
    """Import what the jobs need, so that the first one need not wait for it.

    Garbage collection passes over none of that any more: 0.1 s, in the midst of a stroke.
    """
    from ...field import primitives  # noqa: F401
    from ...field.edit import absorb, boolean, brushed, layers  # noqa: F401
    from ...field.fit import fit  # noqa: F401

    gc.collect()
    gc.freeze()


class Jobs:
    """The handlers and what they remember."""

    def __init__(self, device: "torch.device") -> None:
        """Nothing is known yet; `device` is what strokes are sculpted on."""
        self._store = Store(device)
        self._edits: Cache[str, Edit] = Cache(EDITS, _edit_bytes)  # by the revision they made
        self._shown = ProxyMaker()

    def handlers(self) -> dict[JobKind, Handler]:
        """The handler of each kind of job."""
        return {
            JobKind.EDIT: self.edit,
            JobKind.REPLAY: self.replay,
            JobKind.MEASURE: self.measure,
            JobKind.MESH: self.mesh,
            JobKind.FIT: self.fit,
            JobKind.ABSORB_PROXY: self.absorb_proxy,
            JobKind.ABSORB_STROKE: self.absorb_stroke,
            JobKind.BOOLEAN: self.boolean,
            JobKind.BOOLEAN_MESH: self.boolean_mesh,
            JobKind.LOAD: self.load,
            JobKind.SAVE: self.save,
            JobKind.SAMPLE: self.sample,
            JobKind.PREPARE: self.prepare,
            JobKind.APPLY_TO_BASE: self.apply_to_base,
            JobKind.CONSOLIDATE: self.consolidate,
        }

    def edit(self, job: Task, progress: Progress) -> Payload:
        """state, stroke, solver, resolution, result_revision -> revision, seconds and, of the local
        solver, layer, context <layer, proxy>; of another one base <field, proxy>.
        """
        from ...field.edit.edit import Solver, sculpt

        before = self._store.state(job, sub_progress(progress, 0.0, 0.1))
        stroke = Stroke.from_json(read(job, "stroke", dict))
        solver, share = read(job, "solver", str), sub_progress(progress, 0.1, 0.9)
        if solver == Solver.LOCAL:
            state, solved, edit = before.sculpted(stroke, self._store.memo, share)
            fields, arrays = _layer(solved)
        else:
            edit = sculpt(before.preparation, stroke, solver=solver, progress=share)
            state, data = self._store.new_base(edit.preparation)
            self._store.results[result_key(before.base, stroke, solver)] = state
            fields, arrays = {"base": state.base}, {"field": as_array(data)}
        self._edits[read(job, "result_revision", str)] = edit
        return self._answer(state, {"seconds": edit.seconds, **fields}, arrays, job, progress)

    def replay(self, job: Task, progress: Progress) -> Payload:
        """base, entries, solver, resolution, result_revision -> revision and what `replay` says."""
        state, fields, arrays = replay(self._store, job, sub_progress(progress, 0.0, 0.9))
        return self._answer(state, fields, arrays, job, progress)

    def measure(self, job: Payload, progress: Progress) -> Payload:
        """revision, a result_revision of an edit -> report."""
        revision = read(job, "revision", str)
        if revision not in self._edits:
            raise SculptError("The worker has forgotten this stroke; it cannot be measured.")
        return Payload({"report": _told(self._edits[revision].report(progress=progress))})

    def mesh(self, job: Payload, progress: Progress) -> Payload:
        """state, resolution, triangles -> <proxy>, made anew; if `updated`, from a kept one."""
        if job.fields.get("updated", False):
            state = self._store.state(job, sub_progress(progress, 0.0, 0.5))
            shown = self._shown.state(state, job, sub_progress(progress, 0.5, 1.0))
            return Payload({}, proxy_arrays(shown, in_order=True))
        field = self._store.field(job)
        proxy = _extract(field, job, sub_progress(progress, 0.0, 0.5))
        shown = refined(field, proxy, job, sub_progress(progress, 0.5, 1.0))
        return Payload({}, proxy_arrays(shown, in_order=True))

    def fit(self, job: Task, progress: Progress) -> Payload:
        """primitive, or preset, detail, width, open, thickness, seed, keep_origin, resolution
        <mesh> -> id, scale, center, report <field, proxy>.

        Unless open is "thickness", or there is a thickness, sheets are refused. With `preview`,
        scale, center, report <proxy> come now and then.
        """
        from ...field.fit.fit import Fit, fit_mesh
        from ...field.mesh.proxy import extract
        from ...field.primitives import primitive

        if "primitive" in job.fields:
            result = Fit(primitive(read(job, "primitive", str)), 1.0, (0.0, 0.0, 0.0), {})
        else:

            def show(fit: "Fit") -> None:
                with suppress(SculptError):  # there is no surface yet
                    proxy = extract(fit.field, PREVIEW_CELLS)
                    job.preview(Payload(_place(fit), proxy_arrays(proxy)))

            sheets = job.fields.get("thickness") is not None
            result = fit_mesh(
                read_array(job, "vertices"),
                read_array(job, "triangles"),
                preset=read(job, "preset", str),
                detail=job.fields.get("detail", True),
                width=job.fields.get("width") or 128,
                open_parts=job.fields.get("open"),
                thickness=float(read_numbers(job, "thickness", 1)[0]) if sheets else None,
                seed=read(job, "seed", int),
                keep_origin=job.fields.get("keep_origin", False),
                progress=sub_progress(progress, 0.0, 0.9),
                preview=show if job.fields.get("preview") else lambda _: None,
                enough=job.enough,
            )
        return self._found(result.field, _place(result), job, sub_progress(progress, 0.9, 1.0))

    def absorb_proxy(self, job: Payload, progress: Progress) -> Payload:
        """state, resolution, result_revision <vertices, triangles of the proxy as sculpted> ->
        revision, layer, context, report <layer, proxy>.
        """
        from ...field.edit.absorb import absorb

        before = self._store.state(job, sub_progress(progress, 0.0, 0.1))
        result = absorb(
            before.preparation.field,
            read_array(job, "vertices"),
            read_array(job, "triangles"),
            cells=read(job, "resolution", int),
            progress=sub_progress(progress, 0.1, 0.8),
        )
        return self._one_more(before, result, job, progress)

    def absorb_stroke(self, job: Payload, progress: Progress) -> Payload:
        """state, resolution, remesh, keep, result_revision <before, after, triangles: of the proxy,
        what a brush moved and two rings around it> -> revision, layer, context, report, stretched
        <layer> and <snapped, snapped_normals>: the vertices on the new field. The proxy is
        `stretched` when `remesh` says that it was, or the triangles do not show the field well:
        then <proxy> comes, too, unless it is to `keep` them.
        """
        from ...field.edit.brushed import absorb_brushed
        from ...field.edit.brushed_surface import Brushed

        before = self._store.state(job, sub_progress(progress, 0.0, 0.1))
        result = absorb_brushed(
            before.preparation,
            Brushed(*(read_array(job, name) for name in Brushed._fields)),
            progress=sub_progress(progress, 0.1, 0.9),
        )
        state, solved = before.absorbed(result)
        fields, arrays = _layer(solved)
        fields["report"] = _told(result.report)
        arrays |= zip(SNAPPED, result.snapped, strict=True)
        fields["stretched"] = read(job, "remesh", bool) or not result.is_shown
        if fields["stretched"] and not read(job, "keep", bool):
            return self._answer(state, fields, arrays, job, progress)
        revision = read(job, "result_revision", str)
        self._store.keep(revision, state)
        return Payload({"revision": revision, **fields}, arrays)

    def boolean(self, job: Task, progress: Progress) -> Payload:
        """state, operation, blend, resolution, result_revision and matrix (16 numbers, by rows),
        other: {state, revision}, or <vertices, triangles of a mesh> -> as absorb_proxy.

        The matrix maps the other field's model space to this one's; the mesh is in this one's. With
        `preview`, <proxy> comes first.
        """
        from ...field.edit.boolean import combine

        before = self._store.state(job, sub_progress(progress, 0.0, 0.1))
        solid = self._solid(job)

        def show(proxy: "Proxy") -> None:
            job.preview(Payload({}, proxy_arrays(proxy)))

        result = combine(
            before.preparation.field,
            solid,
            read(job, "operation", str),
            float(read_numbers(job, "blend", 1)[0]),
            preview=show if job.fields.get("preview") else None,
            preview_cells=PREVIEW_CELLS,
            progress=sub_progress(progress, 0.1, 0.8),
        )
        return self._one_more(before, result, job, progress)

    def boolean_mesh(self, job: Payload, progress: Progress) -> Payload:
        """state, operation, blend and the other solid, as boolean -> <proxy>: a coarse one of what
        that would come to.
        """
        from ...field.edit.boolean import show

        proxy = show(
            self._store.field(job),
            self._solid(job),
            read(job, "operation", str),
            float(read_numbers(job, "blend", 1)[0]),
            cells=PREVIEW_CELLS,
            progress=progress,
        )
        return Payload({}, proxy_arrays(proxy))

    def load(self, job: Payload, progress: Progress) -> Payload:
        """path, resolution -> id, widths <field, proxy>."""
        from ...field.checkpoint import load

        field = load(read(job, "path", str))
        return self._found(field, {"widths": list(field.network.widths)}, job, progress)

    def save(self, job: Payload, progress: Progress) -> Payload:
        """state, path -> path."""
        from ...field.checkpoint import save

        path = read(job, "path", str)
        save(self._store.field(job), path)
        return Payload({"path": path})

    def sample(self, job: Payload, progress: Progress) -> Payload:
        """state, resolution -> <band>, see field.volume."""
        from ...field.mesh.volume import sample_band

        band = sample_band(self._store.field(job), read(job, "resolution", int), progress)
        return Payload({}, {"band": band})

    def prepare(self, job: Payload, progress: Progress) -> Payload:
        """state, resolution -> nothing; the next edit of it, and its mesh, start at once."""
        state = self._store.state(job, sub_progress(progress, 0.0, 0.5))
        self._shown.state(state, job, sub_progress(progress, 0.5, 1.0))
        return Payload()

    def apply_to_base(self, job: Payload, progress: Progress) -> Payload:
        """state -> id <field>: the sum of base and layers as a base."""
        state = self._store.state(job, progress)
        flat, data = self._store.new_base(state.preparation)
        return Payload({"id": flat.base}, {"field": as_array(data)})

    def consolidate(self, job: Payload, progress: Progress) -> Payload:
        """state, width, resolution, result_revision -> revision, id, report <field, proxy>."""
        from ...field.fit.consolidate import consolidate
        from ...field.problem.prepare import prepare

        field, width = self._store.field(job), read(job, "width", int)
        result = consolidate(field, width, progress=sub_progress(progress, 0.0, 0.9))
        field = self._store.on_device(result.field)
        state, data = self._store.new_base(prepare(field, sub_progress(progress, 0.9, 0.95)))
        fields = {"id": state.base, "report": result.report}
        share = sub_progress(progress, 0.95, 1.0)
        return self._answer(state, fields, {"field": as_array(data)}, job, share)

    def _solid(self, job: Payload) -> "Solid":
        """The other solid of a Boolean."""
        from ...field.edit.boolean import field_solid, mesh_solid

        if "other" in job.fields:
            other = self._store.field(Payload(read(job, "other", dict), job.arrays))
            return field_solid(other, read_numbers(job, "matrix", 16).reshape(4, 4))
        return mesh_solid(read_array(job, "vertices"), read_array(job, "triangles"))

    def _found(
        self, field: "Field", fields: dict[str, Any], job: Payload, progress: Progress
    ) -> Payload:
        """A field that comes from elsewhere: it becomes a base."""
        from ...field.problem.prepare import CELLS, Preparation

        field = self._store.on_device(field)
        proxy = _extract(field, job, sub_progress(progress, 0.0, 0.5))
        share = sub_progress(progress, 0.5, 1.0)
        if proxy.active.cells == CELLS:
            state, data = self._store.new_base(Preparation(field, proxy))
            name, shown = state.base, self._shown.state(state, job, share)
        else:
            name, data = self._store.keep_base(field)
            shown = refined(field, proxy, job, share)
        arrays = {"field": as_array(data), **proxy_arrays(shown, in_order=True)}
        return Payload({"id": name, **fields}, arrays)

    def _one_more(
        self, before: "State", result: "Absorbed", job: Payload, progress: Progress
    ) -> Payload:
        """The state with one more layer, and the report."""
        from ...field.edit.layers import Term

        solved = before.solved(result.layer)
        terms = (*before.terms, Term(solved.layer, 1.0))
        state = before.moved(terms, sub_progress(progress, 0.8, 0.9))
        fields, arrays = _layer(solved)
        return self._answer(
            state, {"report": _told(result.report), **fields}, arrays, job, progress
        )

    def _answer(
        self,
        state: "State",
        fields: dict[str, Any],
        arrays: dict[str, np.ndarray],
        job: Payload,
        progress: Progress,
    ) -> Payload:
        """The result of a job that made a state, which is remembered."""
        revision = read(job, "result_revision", str)
        self._store.keep(revision, state)
        proxy = self._shown.state(state, job, sub_progress(progress, 0.9, 1.0))
        return Payload({"revision": revision, **fields}, {**arrays, **proxy_arrays(proxy)})


def _extract(field: "Field", job: Payload, progress: Progress) -> "Proxy":
    from ...field.mesh.proxy import extract

    return extract(field, read(job, "resolution", int), progress)


def _layer(solved: "Solved") -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """A layer on top as it travels."""
    fields = {"layer": solved.layer.id, "context": solved.context}
    return fields, {"layer": as_array(solved.layer.data)}


def _place(fit: "Fit") -> dict[str, Any]:
    """Where a fitted field belongs, and how good it is."""
    return {"scale": fit.scale, "center": list(fit.center), "report": _told(fit.report)}


def _told(report: Mapping[str, Any]) -> dict[str, Any]:
    """A report as it travels."""
    notes = [to_json(note) for note in report.get("notes", ())]
    return {**report, **({"notes": notes} if notes else {})}


def _edit_bytes(edit: "Edit") -> int:
    return preparation_bytes(edit.problem.preparation) + preparation_bytes(edit.preparation)
