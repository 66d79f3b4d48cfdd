# SPDX-License-Identifier: GPL-3.0-or-later
"""Kept steps: undo steps of Blender's brushes that stay in Blender's history as they are when the
field has taken in their strokes.

Such a step holds the sculpted vertices and nothing else. The rest of the field is remembered here,
step by step, and brought back when undo or redo has led to one. To take in a stroke nothing is
pushed and the mesh is not touched: Blender would evaluate it, 25 ms with 100,000 vertices.

    ordinary step, stroke, stroke     the first holds the field; that of the others is known here
    stroke, ordinary step             the mode was left before the field had the stroke: known, too

Blender up to 4.5 rounds the vertices when it takes back a stroke of its brushes or brings it back.
There a stroke keeps its step only where one of ours cannot take its place (see `brush_results`),
and the vertices are remembered, too.

Only the mesh's normals are behind, for brushes leave that attribute as it is. Sculpt Mode does not
show it; `settle` writes it when the artist rests, leaves the mode or does something else.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace

import bpy
import numpy as np
from bpy.types import Object
from numpy.typing import NDArray

from . import sculpt_steps, stroke_list
from .mesh import preview_attributes, proxy_mesh
from .mesh.preview import preview
from .properties import field_of, find, is_field
from .sculpt_steps import Step
from .stroke_list import Entry

log = logging.getLogger(__name__)

Vectors = NDArray[np.float32]

EXACT = bpy.app.version >= (5, 0, 0)
"""Whether Blender takes back a stroke of its brushes exactly: earlier versions round the
vertices."""

UNDO_ROUNDING = 1e-7
"""Error of vertices, model units, after Blender up to 4.5 has taken back a stroke of its
brushes."""

MOST_CHANGES = 16
"""Changes that normals are kept as: more take longer to apply, fewer have all normals, 12 bytes a
vertex, kept for fewer steps at once."""


@dataclass(frozen=True)
class Normals:
    """The normals of a proxy, as `base` (V, 3) and what strokes have changed since, in order: which
    vertices (P,), and their normals (P, 3). Steps share what they have in common."""

    base: Vectors
    changes: tuple[tuple[NDArray[np.intp], Vectors], ...] = ()

    def changed(self, some: NDArray[np.intp], normals: Vectors) -> "Normals":
        """The same with other normals (P, 3) at some vertices (P,)."""
        whole = len(self.changes) == MOST_CHANGES
        base, before = (self.all(), ()) if whole else (self.base, self.changes)
        return Normals(base, (*before, (some, normals)))

    def all(self) -> Vectors:
        """Those of all vertices (V, 3)."""
        every = self.base.copy()
        for some, normals in self.changes:
            every[some] = normals
        return every


@dataclass(frozen=True)
class FieldAt:
    """What a field is at a step of Blender's history, beside its vertices.

    count:     vertices of the proxy
    layers:    bytes by id, of those that came with kept steps
    filled:    fingerprint of the vertices as the field has them
    shown:     fingerprint of the vertices that the step holds; the field may lack some strokes
    normals:   None of a mesh that has none of its own
    positions: (V, 3), what the step holds; None where Blender is EXACT
    """

    count: int
    entries: tuple[Entry, ...]
    layers: Mapping[str, bytes]
    revision: str
    report: str
    filled: str
    shown: str
    stretched: bool
    normals: Normals | None
    positions: Vectors | None

    def with_more(self, positions: Vectors) -> "FieldAt":
        """The same at a step that holds further strokes, which led to these vertices (V, 3)."""
        shown = proxy_mesh.fill_mark(positions)
        return replace(self, shown=shown, positions=None if EXACT else positions)


class _State:
    last: Step | None = None
    """Where the scene was in Blender's history at the last look."""


_known: dict[int, dict[Step, FieldAt]] = {}
_unsettled: dict[int, FieldAt] = {}
"""Fields whose normals their meshes still lack. Keys of both: session_uid of the object."""


def field_at(ob: Object, step: Step, positions: Vectors) -> FieldAt:
    """The field of an object, as it has been since a step, with its vertices (V, 3) then."""
    group, mesh = field_of(ob), proxy_mesh.mesh_of(ob)
    known = _known.get(ob.session_uid, {}).get(step)
    if known is not None and known.revision == group.revision:
        return known
    unsettled = _unsettled.get(ob.session_uid)
    normals = None if unsettled is None else unsettled.normals
    if unsettled is None and (shown := proxy_mesh.normals_of(mesh)) is not None:
        normals = Normals(shown)
    return FieldAt(
        count=len(mesh.vertices),
        entries=tuple(stroke_list.readable(ob)),
        layers={},
        revision=group.revision,
        report=group.report,
        filled=mesh.get(proxy_mesh.FILLED, ""),
        shown=mesh.get(proxy_mesh.FILLED, ""),
        stretched=proxy_mesh.STRETCHED in mesh,
        normals=normals,
        positions=None if EXACT else positions,
    )


def grown(
    ob: Object,
    before: FieldAt,
    entry: Entry,
    layer: bytes,
    some: NDArray[np.intp],
    normals: Vectors,
    positions: Vectors,
) -> FieldAt:
    """The field with one entry more, whose stroke led to these vertices (V, 3), and gave `some` of
    them (P,) other normals (P, 3)."""
    group, mesh, old = field_of(ob), proxy_mesh.mesh_of(ob), before.normals
    return FieldAt(
        count=len(mesh.vertices),
        entries=(*before.entries, entry),
        layers={**before.layers, entry.layer: layer},
        revision=group.revision,
        report=group.report,
        filled=mesh[proxy_mesh.FILLED],
        shown=mesh[proxy_mesh.FILLED],
        stretched=proxy_mesh.STRETCHED in mesh,
        normals=None if old is None else old.changed(some, normals.copy()),
        positions=None if EXACT else positions,
    )


def know(ob: Object, step: Step, field: FieldAt) -> None:
    """Remember what a field is at a step, and forget those that Blender has forgotten."""
    before, after = sculpt_steps.steps()
    _State.last = before[-1] if before else None
    for steps in _known.values():
        for gone in steps.keys() - {*before, *after}:
            del steps[gone]
    _known.setdefault(ob.session_uid, {})[step] = field


def unsettle(ob: Object, field: FieldAt) -> None:
    """Note that the proxy, which shows this field, still lacks the field's normals."""
    if field.normals is not None:
        _unsettled[ob.session_uid] = field


def look(active: Step | None) -> None:
    """Note the active step, to which neither undo nor redo has led. If it is not the one noted last
    it is new, and what is known of its address is of a step that is gone: that is forgotten."""
    if active is not None and active != _State.last:
        for steps in _known.values():
            steps.pop(active, None)
    _State.last = active


def follow() -> None:
    """After undo and redo: bring the fields to what they were at the step that Blender has come to.

    At an ordinary step, and of fields that are not being sculpted, Blender has brought all that
    there was when the step was made: what became known later is missing. Where Global Undo is off a
    neural stroke is no step, and Blender leaves its proxy, which has other vertices, as it is.
    """
    before, _ = sculpt_steps.steps()
    _State.last = before[-1] if before else None
    for target, known in [*_known.items()]:
        ob = find(target)
        if not before or not is_field(ob) or proxy_mesh.why_locked(ob):
            continue
        sculpted = sculpt_steps.is_native(before[-1]) and ob == bpy.context.active_object
        for step in reversed(before):
            if (field := known.get(step)) is not None and _is_at(ob, field, sculpted):
                _bring(ob, field)
            if field is not None or not sculpt_steps.is_native(step):
                break


def _is_at(ob: Object, field: FieldAt, sculpted: bool) -> bool:
    """Whether Blender has brought the vertices that were known; those of a proxy that is sculpted
    may have been moved since by strokes that nobody knows."""
    if len(proxy_mesh.mesh_of(ob).vertices) != field.count:
        return False
    return sculpted or _shows(ob, field)


def _shows(ob: Object, field: FieldAt) -> bool:
    """Whether the proxy has the vertices that were known. It has not where another ordinary step
    has taken the place in memory of the one that was known."""
    now = proxy_mesh.positions(ob)
    if field.positions is not None:
        return is_back(now, field.positions)
    return proxy_mesh.fill_mark(now) == field.shown


def is_back(now: Vectors, then: Vectors) -> bool:
    """Whether vertices (V, 3) are where they were, up to UNDO_ROUNDING."""
    return now.shape == then.shape and float(np.abs(now - then).max(initial=0)) <= UNDO_ROUNDING


def put_back(ob: Object, then: Vectors) -> None:
    """Put vertices that are back exactly to where they were (V, 3)."""
    mesh = proxy_mesh.mesh_of(ob)
    if not np.array_equal(proxy_mesh.positions(ob), then):
        proxy_mesh.put(mesh, then)
        mesh.update()


def _bring(ob: Object, field: FieldAt) -> None:
    """Make a field what it was, where it is not."""
    group, mesh = field_of(ob), proxy_mesh.mesh_of(ob)
    if group.revision != field.revision:
        held = {item.layer_id for item in group.strokes} | field.layers.keys()
        if any(entry.layer and entry.layer not in held for entry in field.entries):
            log.error("%s lacks layers of a step of Blender's history", ob.name)
            return
        stroke_list.write(ob, field.entries, field.layers)
        group.revision, group.report = field.revision, field.report
    mesh[proxy_mesh.FILLED] = field.filled
    if field.positions is not None and _shows(ob, field):
        put_back(ob, field.positions)
    if field.stretched:
        mesh[proxy_mesh.STRETCHED] = True
    elif proxy_mesh.STRETCHED in mesh:
        del mesh[proxy_mesh.STRETCHED]
    unsettle(ob, field)


def is_settled() -> bool:
    """Whether all meshes have their normals."""
    return not _unsettled


def note_pushed() -> None:
    """A step was pushed before the normals that are behind were written."""
    for target, field in _unsettled.items():
        if (ob := find(target)) is not None:
            _know_pushed(ob, field)


def settle() -> None:
    """Write the normals that are behind. Blender then evaluates the mesh."""
    for target, field in [*_unsettled.items()]:
        ob = find(target)
        if ob is not None and proxy_mesh.why_locked(ob):
            continue
        del _unsettled[target]
        if ob is None or not _know_pushed(ob, field):
            continue
        with preview.hidden():
            mesh = proxy_mesh.mesh_of(ob)
            now = proxy_mesh.normals_of(mesh)
            if now is None or field.normals is None or now.shape != field.normals.base.shape:
                continue
            wanted = field.normals.all()
            if not np.array_equal(now, wanted):
                proxy_mesh.put_normals(mesh, wanted)


def _know_pushed(ob: Object, field: FieldAt) -> bool:
    """Remember a field at the active step if that is an ordinary one, which lacks its normals;
    whether the proxy shows this field, and maybe strokes that the field has not got yet."""
    mesh = proxy_mesh.mesh_of(ob)
    if mesh.get(proxy_mesh.FILLED) != field.filled:
        return False
    step = sculpt_steps.active()
    if step is not None and not sculpt_steps.is_native(step):
        know(ob, step, field.with_more(preview_attributes.true_positions(mesh)))
    return True


def forget() -> None:
    """Another file was loaded."""
    _known.clear()
    _unsettled.clear()
    _State.last = None
