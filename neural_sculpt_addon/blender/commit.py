# SPDX-License-Identifier: GPL-3.0-or-later
"""The one way in which a result of the worker reaches the scene, and becomes one undo step.

Weights, revision, strokes, report and proxy change together or not at all: what may fail is done
ahead of the first change. The result's mesh is in model space, which is the object's local space.
"""

# pyright: reportOptionalMemberAccess=false

import json
import uuid
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.types import Mesh, Object
from mathutils import Matrix

from ..stroke.stroke import Stroke
from ..worker.client import Message
from . import preview, proxy_mesh, sculpt_steps, stroke_list
from .properties import brush_of, ensure_curves, field_of
from .proxy_mesh import Geometry
from .stroke_list import Entry

PROXY = ("vertices", "normals", "triangles", "edges", "corner_edges")
"""The arrays of a result that are its mesh."""


def new_revision() -> str:
    """A name for a state of the weights. A counter would collide after undo and a new stroke."""
    return uuid.uuid4().hex


@dataclass(frozen=True)
class NewField:
    """What a new object is called and where it is placed."""

    name: str
    source: str
    matrix: Matrix
    resolution: int


def create_field(
    new: NewField, result: Message, report: Mapping[str, Any], replaced: Object | None = None
) -> Object:
    """Add an object for a field that has no strokes yet, and select it in Object Mode.

    `replaced`, the mesh whose place it takes, is hidden.
    """
    state = _state(result, new_revision(), report, smooth=True)
    begin_change()
    mesh = bpy.data.meshes.new(new.name)
    ob = bpy.data.objects.new(new.name, mesh)
    ob.matrix_world = new.matrix
    with in_window():
        bpy.context.collection.objects.link(ob)
        if bpy.context.mode == "OBJECT":  # the artist may edit something else by now
            _present(ob, replaced)
        if bpy.context.scene.library is None:
            ensure_curves(brush_of(bpy.context))  # in this undo step, for all that follows
    group = field_of(ob)
    group.base_weights = state.weights
    group.source = new.source
    group.resolution = new.resolution
    _write(ob, state)
    push_undo(f"Add {new.name}")
    return ob


def add_strokes(ob: Object, strokes: Iterable[Stroke], result: Message, label: str) -> None:
    """Append strokes whose edit is `result`. SculptError when the object is locked."""
    proxy_mesh.refuse_locked(ob)
    state = _edited(ob, result)
    begin_change()
    _write(ob, state)
    stroke_list.append(ob, strokes)
    push_undo(label)


def keep_strokes(ob: Object, strokes: Iterable[Stroke], label: str) -> None:
    """Append strokes whose edit could not be had or shown, muted. SculptError for a linked object,
    which cannot be changed."""
    if ob.library or ob.override_library:
        proxy_mesh.refuse_locked(ob)
    begin_change()
    stroke_list.append(ob, strokes, muted=True)
    push_undo(label)


def show(ob: Object, result: Message) -> None:
    """Write an edit's result, which is no undo step by itself."""
    _write(ob, _edited(ob, result))


def set_history(
    ob: Object,
    listed: Iterable[Entry],
    label: str,
    result: Message | None = None,
    as_base: bool = False,
) -> None:
    """Replace the list of strokes, and the field by what a replay of the unmuted ones made.

    Without a result the unmuted strokes must be the same as before.

    as_base: whether the result is the new base, too

    SculptError when the object is locked.
    """
    proxy_mesh.refuse_locked(ob)
    state = None if result is None else _edited(ob, result)
    begin_change()
    if state is not None:
        _write(ob, state)
        if as_base:
            field_of(ob).base_weights = state.weights
    stroke_list.write(ob, listed)
    push_undo(label)


def apply_to_base(ob: Object, label: str) -> None:
    """Make the field as it is the base, and take the strokes that made it off the list.

    That ends a damaged history, too. SculptError when the object is locked.
    """
    proxy_mesh.refuse_locked(ob)
    muted = [entry for entry in stroke_list.readable(ob) if entry.muted]
    group = field_of(ob)
    begin_change()
    group.base_weights = group.weights
    stroke_list.write(ob, muted)
    push_undo(label)


def set_proxy(ob: Object, resolution: int, smooth: bool, result: Message) -> None:
    """Replace the proxy by another one of the same field. SculptError when the object is locked."""
    proxy_mesh.refuse_locked(ob)
    group = field_of(ob)
    geometry = _geometry(result, smooth)
    begin_change()
    _fill(ob, geometry)
    group.resolution, group.smooth = resolution, smooth
    push_undo("Remesh Proxy")


@dataclass(frozen=True)
class _State:
    """All that a result writes on an object."""

    weights: bytes
    revision: str
    report: str
    geometry: Geometry


def _edited(ob: Object, result: Message) -> _State:
    """The state that an edit's result leads to."""
    reports = result.fields["reports"]
    report = reports[-1] if reports else {}
    return _state(result, result.fields["revision"], report, field_of(ob).smooth)


def _state(result: Message, revision: str, report: Mapping[str, Any], smooth: bool) -> _State:
    weights = result.arrays["field"].tobytes()
    return _State(weights, revision, json.dumps(report), _geometry(result, smooth))


def _geometry(result: Message, smooth: bool) -> Geometry:
    return proxy_mesh.geometry(*(result.arrays[name] for name in PROXY), smooth=smooth)


def _write(ob: Object, state: _State) -> None:
    _fill(ob, state.geometry)
    group = field_of(ob)
    group.weights, group.revision, group.report = state.weights, state.revision, state.report


def _fill(ob: Object, geometry: Geometry) -> None:
    """Write the proxy; a mesh shared with other objects is left to them."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    if mesh.users > 1:
        mesh = mesh.copy()
        ob.data = mesh
    proxy_mesh.fill(mesh, geometry)


def _present(ob: Object, replaced: Object | None) -> None:
    """Make the object the only selected and the active one, in the place of another."""
    for other in bpy.context.selected_objects or ():
        other.select_set(False)
    ob.select_set(True)
    objects = bpy.context.view_layer.objects
    objects.active = ob
    if replaced is not None and replaced.name in objects:
        replaced.hide_set(True)
        replaced.hide_render = True


def begin_change() -> None:
    """Ahead of a change that `push_undo` makes an undo step of: Ctrl Z must take it back whole."""
    with in_window():
        sculpting = bpy.context.mode == "SCULPT"
    if sculpting and sculpt_steps.last_is_of_sculpt_mode():
        push_undo("Sculpt")


def push_undo(label: str) -> None:
    """Let Blender remember everything as it is, without what is only previewed."""
    preview.hide()
    with in_window():
        bpy.ops.ed.undo_push(message=label)


def in_edit_mode() -> bool:
    """Whether the artist is in Edit Mode of anything, whose undo steps hold nothing else."""
    with in_window():
        return bpy.context.mode.startswith("EDIT")


def in_window() -> Any:
    """A context with a window, which a timer lacks just after a file was loaded."""
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0])
