# SPDX-License-Identifier: GPL-3.0-or-later
"""Source mesh: what an object's modifiers make of it, for a field to be fitted to or cut by, or for
a file.

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
    """Materials of an object's slots by those of its mesh in whose place they are."""
    assert isinstance(ob.data, Mesh)
    pairs = zip(ob.data.materials, ob.material_slots, strict=False)
    return {material: slot.material for material, slot in pairs if slot.link == "OBJECT"}


def has_faces(ob: Object) -> bool:
    """Whether modifiers leave any face of an object, or put instances with some in its place."""
    with _evaluated(ob) as (_, mesh):
        return bool(mesh.polygons)


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
    """An object as its modifiers show it, and its mesh.

    Blender lists instances of all objects together, of which there may be very many. So where nodes
    may have made some, they are realized, and there were some if that adds vertices.
    """
    shown = _shown(ob)
    if not shown.is_evaluated or any(modifier.type == "NODES" for modifier in ob.modifiers):
        own = _vertices(shown) if shown.is_evaluated else None
        with _realized(ob) as (whole, mesh):
            if len(mesh.vertices) != own:
                yield whole, mesh
                return
    shown = _shown(ob)
    with _mesh_of(shown) as mesh:
        yield shown, mesh


def _shown(ob: Object) -> Object:
    """The evaluated object, or itself where Blender does not evaluate it."""
    return ob.evaluated_get(bpy.context.evaluated_depsgraph_get())


def _vertices(shown: Object) -> int:
    """How many vertices the mesh of an evaluated object has."""
    with _mesh_of(shown) as mesh:
        return len(mesh.vertices)


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
        shown = _shown(holder)
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
