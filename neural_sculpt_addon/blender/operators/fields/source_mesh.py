# SPDX-License-Identifier: GPL-3.0-or-later
"""Source mesh: what an object's modifiers make of it, for a field to be fitted to or cut by.

Instances that geometry nodes put in its place are a part of it, as the artist sees it. So is what
modifiers do to an object that is disabled in viewports, which Blender does not evaluate.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.types import ID, Mesh, NodeTree, Object
from mathutils import Matrix
from numpy.typing import NDArray

from ....common.errors import SculptError
from ....common.text import Text
from ... import notice
from ...scene.mesh import proxy_mesh
from ...scene.mesh.dress import Dress


@dataclass(frozen=True)
class SourceMesh:
    """A mesh in a frame of the world, and what a field of it is to wear.

    materials: the session_uid of the material in each slot, 0 in an empty one
    """

    vertices: NDArray[np.float32]  # (V, 3)
    triangles: NDArray[np.int32]  # (F, 3)
    dress: Dress
    materials: tuple[int, ...]


def read(source: Object, frame: Matrix) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (F, 3) of the evaluated mesh in a frame of the world.

    SculptError when it has no faces.
    """
    with _evaluated(source) as (_, mesh):
        return _triangles(source, mesh, frame)


def read_dressed(source: Object, frame: Matrix) -> SourceMesh:
    """The evaluated mesh in a frame of the world. SculptError when it has no faces."""
    with _evaluated(source) as (shown, mesh):
        vertices, triangles = _triangles(source, mesh, frame)
        dress = Dress.of(shown, mesh, vertices, _turns(source, frame))
        slots = [slot.material for slot in shown.material_slots]
        given = [each.original if each else None for each in slots]
        if shown.original != source:  # it has the materials of the mesh alone
            own = _of_slots(source)
            given = [own.get(each, each) for each in given]
    uids = tuple(each.session_uid if each else 0 for each in given)
    return SourceMesh(vertices, triangles, dress, uids)


def _of_slots(ob: Object) -> dict[ID | None, ID | None]:
    """The object's own material, which its slot has, for one of its mesh."""
    assert isinstance(ob.data, Mesh)
    pairs = zip(ob.data.materials, ob.material_slots, strict=False)
    return {material: slot.material for material, slot in pairs if slot.link == "OBJECT"}


def has_faces(ob: Object) -> bool:
    """Whether modifiers leave any face of an object, or put instances with some in its place."""
    shown = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return _has_faces(shown) or any(map(_has_faces, _instanced(ob)))


def tell_if_linked(source: Object) -> None:
    """Tell that an object of another file does not stay hidden."""
    if source.library is not None:
        notice.tell(
            Text(
                "{} is linked from another file: when this one is opened again, it is rendered as"
                " well. Make it local, or take it out of the scene.",
                source.name,
            )
        )


def _has_faces(evaluated: Object | None) -> bool:
    mesh = None if evaluated is None else evaluated.data
    return isinstance(mesh, Mesh) and bool(mesh.polygons)


def _instanced(ob: Object) -> Iterator[Object | None]:
    """The evaluated object of each instance that an object makes."""
    for each in bpy.context.evaluated_depsgraph_get().object_instances:
        if each.is_instance and each.parent is not None and each.parent.original == ob:
            yield each.object


def _triangles(
    source: Object, mesh: Mesh, frame: Matrix
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    vertices, triangles = proxy_mesh.read(mesh)
    if not len(triangles):
        raise SculptError("{} has no faces. Choose a mesh with a closed surface.", source.name)
    shape = frame.inverted_safe() @ source.matrix_world
    linear, offset = np.array(shape.to_3x3()), np.array(shape.translation)  # (3, 3), (3,)
    if _turns(source, frame):
        triangles = triangles[:, ::-1]
    vertices = (vertices @ linear.T + offset).astype(np.float32)  # (V, 3)
    return vertices, np.ascontiguousarray(triangles)


def _turns(source: Object, frame: Matrix) -> bool:
    """Whether the source is mirrored in the frame, so that its triangles are turned over."""
    return source.matrix_world.determinant() * frame.determinant() < 0


@contextmanager
def _evaluated(ob: Object) -> Iterator[tuple[Object, Mesh]]:
    """An object as its modifiers show it, and its mesh."""
    shown = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    if not shown.is_evaluated or _has_instances(ob):
        with _realized(ob) as whole:
            yield whole
        return
    with _mesh_of(shown) as mesh:
        yield shown, mesh


def _has_instances(ob: Object) -> bool:
    """Whether geometry nodes put instances with a mesh in an object's place. What an object makes
    is not told but among all instances of a scene, of which there may be very many."""
    if not any(modifier.type == "NODES" for modifier in ob.modifiers):
        return False
    with _mesh_of(ob.evaluated_get(bpy.context.evaluated_depsgraph_get())) as mesh:
        count = len(mesh.vertices)
    with _realized(ob) as (_, whole):
        return len(whole.vertices) != count


@contextmanager
def _mesh_of(evaluated: Object) -> Iterator[Mesh]:
    try:
        yield evaluated.to_mesh()
    finally:
        evaluated.to_mesh_clear()


@contextmanager
def _realized(ob: Object) -> Iterator[tuple[Object, Mesh]]:
    """An evaluated object whose mesh is that of another one with its instances, in local space.

    Its nodes take it from the other object. A copy of that would have no simulation's state.
    """
    nodes = bpy.data.node_groups.new("Neural Sculpt source", "GeometryNodeTree")
    mesh = bpy.data.meshes.new(nodes.name)
    holder = bpy.data.objects.new(nodes.name, mesh)
    try:
        _take_realized(nodes, ob)
        modifier = holder.modifiers.new(nodes.name, "NODES")
        modifier.node_group = nodes  # pyright: ignore[reportAttributeAccessIssue]
        bpy.context.scene.collection.objects.link(holder)
        shown = holder.evaluated_get(bpy.context.evaluated_depsgraph_get())
        with _mesh_of(shown) as whole:
            yield shown, whole
    finally:
        bpy.data.objects.remove(holder)
        bpy.data.meshes.remove(mesh)
        bpy.data.node_groups.remove(nodes)


def _take_realized(nodes: NodeTree, ob: Object) -> None:
    """Let geometry nodes make the mesh of an object, with its instances."""
    kind: Any = "NodeSocketGeometry"  # which the stubs do not know
    nodes.interface.new_socket("Geometry", in_out="OUTPUT", socket_type=kind)
    kinds = ("GeometryNodeObjectInfo", "GeometryNodeRealizeInstances", "NodeGroupOutput")
    info, realize, made = (nodes.nodes.new(each) for each in kinds)
    info.inputs["Object"].default_value = ob  # pyright: ignore[reportAttributeAccessIssue]
    nodes.links.new(info.outputs["Geometry"], realize.inputs[0])
    nodes.links.new(realize.outputs[0], made.inputs[0])
