# SPDX-License-Identifier: GPL-3.0-or-later
"""Commit of a result of the worker: the one way in which it reaches the scene, as one undo step.

Field, revision, strokes, report and proxy change together or not at all: what may fail is done
ahead of the first change. The result's mesh is in model space, which is the object's local space.
"""

import json
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from bpy.types import Mesh, Object, SpaceView3D
from mathutils import Matrix
from numpy.typing import NDArray

from ...worker.answers import SNAPPED
from ...worker.client import Message
from . import next_proxy, stroke_list, succession
from .mesh import attributes, proxy_mesh
from .mesh.attributes import Attributes
from .mesh.proxy_mesh import Geometry
from .next_proxy import geometry_of, next_geometry
from .properties import LOCAL, NEURAL_SCULPT_PG_field, field_of
from .proxy_properties import ShownAs
from .results import ObjectState, bytes_of, computed, edited
from .sculpt_steps import RENEWED
from .stroke_list import Entry
from .undo_step import begin_change, in_window, push_undo


def new_revision() -> str:
    """A new name for a state of the field: a uuid, for a counter would give a name twice after undo
    and a new stroke."""
    return uuid.uuid4().hex


@dataclass(frozen=True)
class NewField:
    """What a new object is called and where it is placed.

    scene: session_uid of the scene in which it was asked for
    scale: in the world, what the artist reads as the object's scale; the rest of the matrix's, as
           the model's box asks for, is its delta scale. None where there was no object before it
    materials: the session_uid of the material in each slot, 0 in an empty one
    """

    name: str
    source: str
    scene: int
    matrix: Matrix
    shown: ShownAs
    solver: str = LOCAL
    scale: float | None = None
    materials: tuple[int, ...] = ()


def create_field(
    new: NewField,
    result: Message,
    report: Mapping[str, Any],
    replaced: Object | None = None,
    worn: Attributes | None = None,
) -> Object:
    """Add an object for a field that has no strokes yet, and select it in Object Mode.

    replaced: the mesh whose place it takes, which is hidden and hands on what hangs on the object
    worn:     what hung on that mesh, which may be gone by now
    """
    base = bytes_of(result, "field")
    geometry = replace(geometry_of(result, smooth=True), attributes=worn)
    state = ObjectState(new_revision(), json.dumps(report), geometry)
    begin_change()
    mesh = bpy.data.meshes.new(new.name)
    known = {material.session_uid: material for material in bpy.data.materials}
    for uid in new.materials:
        mesh.materials.append(known.get(uid))
    ob = bpy.data.objects.new(new.name, mesh)
    if new.scale is not None:
        ob.delta_scale = new.matrix.to_scale() / new.scale
    ob.matrix_world = new.matrix
    with in_window(new.scene):
        succession.link(ob, replaced, new.scene)
        _present(ob, replaced)
    group = field_of(ob)
    group.base_weights, group.base_id = base, result.fields["id"]
    group.source, group.solver = new.source, new.solver
    _show_as(group, new.shown)
    _write(ob, state)
    if replaced is not None:
        succession.inherit(ob, replaced)
    push_undo(f"Add {new.name}")
    return ob


def add_entry(
    ob: Object, entry: Entry, result: Message, label: str, replaced: Object | None = None
) -> None:
    """Append the entry of an edit or of absorbed sculpting, and hide the other object of a Boolean.
    In a file that is older than layers, a layer stands on the field as a whole: that becomes the
    base. SculptError when the object is locked."""
    proxy_mesh.refuse_locked(ob)
    state, layers = edited(ob, result), {}
    if "layer" in result.fields:
        entry = replace(entry, layer=result.fields["layer"], context=result.fields["context"])
        layers[entry.layer] = bytes_of(result, "layer")
    begin_change()
    group = field_of(ob)
    if layers and group.weights:
        _take_as_base(ob, group.weights, group.weights_id)
    _write(ob, state)
    stroke_list.append(ob, (entry,), layers)
    _hide(replaced)
    push_undo(label)


def add_brushed(
    ob: Object,
    entry: Entry,
    result: Message,
    vertices: NDArray[np.intp],
    positions: NDArray[np.float32],
) -> None:
    """Append an entry of a brush stroke, after which the proxy keeps its triangles, for others
    follow or they show the field well. Blender draws it after `Mesh.update`.

    vertices:  (P,) those that have new normals
    positions: (V, 3) of all

    SculptError when the object is locked.
    """
    proxy_mesh.refuse_locked(ob)
    fields, layer = result.fields, bytes_of(result, "layer")
    entry = replace(entry, layer=fields["layer"], context=fields["context"])
    normals = result.arrays[SNAPPED[1]]
    begin_change()
    mesh = _own_mesh(ob)
    proxy_mesh.move(mesh, positions, vertices, normals)
    if fields["stretched"]:
        mesh[proxy_mesh.STRETCHED] = True
    group = field_of(ob)
    group.revision, group.report = fields["revision"], json.dumps(fields["report"])
    stroke_list.append(ob, (entry,), {entry.layer: layer})
    push_undo(entry.name)


def add_kept(ob: Object, entry: Entry, result: Message, filled: str, off: bool) -> Entry:
    """Append an entry of a brush stroke whose step in Blender's history stays (see `kept_steps`),
    as does the proxy, with this fingerprint; the entry with its layer.

    off: whether another proxy is to come, for this one is off the field
    """
    fields = result.fields
    entry = replace(entry, layer=fields["layer"], context=fields["context"])
    group, mesh = field_of(ob), proxy_mesh.mesh_of(ob)
    mesh[proxy_mesh.FILLED] = filled
    if fields["stretched"] or off:
        mesh[proxy_mesh.STRETCHED] = True
    group.revision, group.report = fields["revision"], json.dumps(fields["report"])
    stroke_list.append(ob, (entry,), {entry.layer: bytes_of(result, "layer")})
    return entry


def keep_entries(ob: Object, added: Sequence[Entry], label: str) -> None:
    """Append entries, muted, whose edit has failed. SculptError for a linked object, which cannot
    be changed."""
    if ob.library or ob.override_library:
        proxy_mesh.refuse_locked(ob)
    begin_change()
    stroke_list.append(ob, [replace(entry, muted=True) for entry in added], {})
    push_undo(label)


def set_history(
    ob: Object, listed: Sequence[Entry], label: str, result: Message | None = None
) -> None:
    """Replace the list of strokes, and the field by the result of a replay of the unmuted ones.
    Without a result the unmuted strokes must be the same as before.

    SculptError when the object is locked.
    """
    proxy_mesh.refuse_locked(ob)
    state, layers = None, {}
    if result is not None:
        state = edited(ob, result)
        listed, layers = computed(listed, result)
    begin_change()
    if state is not None:
        _write(ob, state)
    stroke_list.write(ob, listed, layers)
    push_undo(label)


def set_base(ob: Object, label: str, base: bytes, name: str, result: Message | None = None) -> None:
    """Make `base`, whose id is `name`, the base and take all unmuted entries off the list. It is
    the field as it was, or another one, given with the result that has its proxy. A damaged history
    ends here, too. SculptError when the object is locked.
    """
    proxy_mesh.refuse_locked(ob)
    state = None if result is None else edited(ob, result)
    begin_change()
    if state is not None:
        _write(ob, state)
    else:  # the worker remembers by the revision what later layers stand on
        field_of(ob).revision = new_revision()
    _take_as_base(ob, base, name)
    push_undo(label)


def set_solver(ob: Object, solver: str, label: str) -> None:
    """Choose the solver, and so what strokes change. The field must have no strokes yet."""
    begin_change()
    field_of(ob).solver = solver
    push_undo(label)


def set_proxy(ob: Object, shown: ShownAs, result: Message) -> None:
    """Replace the proxy by another one of the same field. SculptError when the object is locked."""
    proxy_mesh.refuse_locked(ob)
    group = field_of(ob)
    geometry = next_geometry(ob, result, shown.smooth)
    begin_change()
    _fill(ob, geometry)
    _show_as(group, shown)
    push_undo("Remesh Proxy")


def renew_proxy(ob: Object, result: Message) -> None:
    """Replace the proxy by another one of the same field, which nobody asked for: undo passes over
    it. SculptError when the object is locked."""
    proxy_mesh.refuse_locked(ob)
    _fill(ob, next_geometry(ob, result, field_of(ob).smooth))
    push_undo(RENEWED)


def _show_as(group: NEURAL_SCULPT_PG_field, shown: ShownAs) -> None:
    group.resolution, group.smooth = shown.resolution, shown.smooth
    group.refine, group.most_triangles = shown.refine, shown.most_triangles


def _take_as_base(ob: Object, base: bytes, name: str) -> None:
    group = field_of(ob)
    muted = [entry for entry in stroke_list.readable(ob) if entry.muted]
    group.base_weights, group.base_id = base, name
    group.weights, group.weights_id = b"", ""
    stroke_list.write(ob, muted, {})


def _write(ob: Object, state: ObjectState) -> None:
    _fill(ob, state.geometry)
    group = field_of(ob)
    group.revision, group.report = state.revision, state.report
    group.weights, group.weights_id = state.weights, state.weights_id


def _fill(ob: Object, geometry: Geometry) -> None:
    """Write the proxy."""
    if next_proxy.show(ob, geometry):
        return
    mesh = _own_mesh(ob)
    proxy_mesh.fill(mesh, geometry)
    if geometry.attributes is not None:
        attributes.write(ob, geometry.attributes)
        mesh.update_tag()


def _own_mesh(ob: Object) -> Mesh:
    """The mesh to be changed. One that other objects share is left to them, and this object gets a
    mesh of its own."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    if mesh.users > 1:
        mesh = mesh.copy()
        ob.data = mesh
    return mesh


def _present(ob: Object, replaced: Object | None) -> None:
    """Show the object in place of another, which is hidden, and select it. If the artist works at
    something else by now that stays the active one, and stays in sight. A viewport in Local View
    shows the object, as it does objects that Blender adds."""
    active, at_work = bpy.context.active_object, bpy.context.mode != "OBJECT"
    if ob.name in bpy.context.view_layer.objects:
        for area in bpy.context.screen.areas:
            space = area.spaces.active
            if isinstance(space, SpaceView3D) and space.local_view is not None:
                ob.local_view_set(space, True)
        if not at_work and (replaced is None or active in (None, replaced)):
            select(ob)
    if not at_work or replaced != active:
        _hide(replaced)


def _hide(ob: Object | None) -> None:
    """Hide an object that something else stands for now: in the view layer, or in the scenes where
    it is."""
    if ob is None:
        return
    with in_window():
        shown, scenes = bpy.context.view_layer, ob.users_scene
        others = (layer for scene in scenes for layer in scene.view_layers)
        layers = [shown] if ob.name in shown.objects else others
        for layer in layers:
            if ob.name in layer.objects:
                ob.hide_set(True, view_layer=layer)
                ob.hide_render = True


def select(ob: Object) -> None:
    """Make the object the only selected and the active one."""
    for other in bpy.context.selected_objects or ():
        other.select_set(False)
    ob.select_set(True)
    bpy.context.view_layer.objects.active = ob
