# SPDX-License-Identifier: GPL-3.0-or-later
"""The one way in which a result of the worker reaches the scene, and becomes one undo step.

Weights, revision, strokes, report and proxy change together. The result's mesh is in model space,
which is the object's local space.
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
from . import preview, proxy_mesh, stroke_list
from .properties import field_of
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
    mesh = bpy.data.meshes.new(new.name)
    ob = bpy.data.objects.new(new.name, mesh)
    ob.matrix_world = new.matrix
    with in_window():
        bpy.context.collection.objects.link(ob)
        if bpy.context.mode == "OBJECT":  # the artist may edit something else by now
            _present(ob, replaced)
    group = field_of(ob)
    group.base_weights = result.arrays["field"].tobytes()
    group.source = new.source
    group.resolution = new.resolution
    _write(ob, result, new_revision(), report)
    push_undo(f"Add {new.name}")
    return ob


def add_strokes(ob: Object, strokes: Iterable[Stroke], result: Message, label: str) -> None:
    """Append strokes whose edit is `result`. SculptError when the object is locked."""
    proxy_mesh.refuse_locked(ob)
    stroke_list.append(ob, strokes)
    show(ob, result)
    push_undo(label)


def show(ob: Object, result: Message) -> None:
    """Write an edit's result, which is no undo step by itself."""
    reports = result.fields["reports"]
    _write(ob, result, result.fields["revision"], reports[-1] if reports else {})


def set_history(
    ob: Object, listed: Iterable[Entry], label: str, result: Message | None = None
) -> None:
    """Replace the list of strokes, and the field by what a replay of the unmuted ones made.

    Without a result the unmuted strokes must be the same as before.

    SculptError when the object is locked.
    """
    proxy_mesh.refuse_locked(ob)
    stroke_list.write(ob, listed)
    if result is not None:
        show(ob, result)
    push_undo(label)


def apply_to_base(ob: Object, label: str) -> None:
    """Make the field as it is the base, and take the strokes that made it off the list.

    That ends a damaged history, too. SculptError when the object is locked.
    """
    proxy_mesh.refuse_locked(ob)
    muted = [entry for entry in stroke_list.readable(ob) if entry.muted]
    group = field_of(ob)
    group.base_weights = group.weights
    stroke_list.write(ob, muted)
    push_undo(label)


def set_proxy(ob: Object, resolution: int, smooth: bool, result: Message) -> None:
    """Replace the proxy by another one of the same field. SculptError when the object is locked."""
    proxy_mesh.refuse_locked(ob)
    group = field_of(ob)
    group.resolution, group.smooth = resolution, smooth
    _fill(ob, result)
    push_undo("Remesh Proxy")


def _write(ob: Object, result: Message, revision: str, report: Mapping[str, Any]) -> None:
    group = field_of(ob)
    group.weights = result.arrays["field"].tobytes()
    group.revision = revision
    group.report = json.dumps(report)
    _fill(ob, result)


def _fill(ob: Object, result: Message) -> None:
    """Write the proxy; a mesh shared with other objects is left to them."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    if mesh.users > 1:
        mesh = mesh.copy()
        ob.data = mesh
    arrays = (result.arrays[name] for name in PROXY)
    proxy_mesh.fill(mesh, *arrays, smooth=field_of(ob).smooth)


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


def push_undo(label: str) -> None:
    """Let Blender remember everything as it is, without what is only previewed."""
    preview.hide()
    with in_window():
        bpy.ops.ed.undo_push(message=label)


def in_window() -> Any:
    """A context with a window, which a timer lacks just after a file was loaded."""
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0])
