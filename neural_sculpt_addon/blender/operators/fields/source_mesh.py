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
from bpy.types import Mesh, NodeTree, Object
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
    materials = tuple(each.original.session_uid if each else 0 for each in slots)
    return SourceMesh(vertices, triangles, dress, materials)


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
    has_nodes = any(modifier.type == "NODES" for modifier in ob.modifiers)
    if shown.is_evaluated and not (has_nodes and any(map(_has_faces, _instanced(ob)))):
        with _mesh_of(shown) as mesh:
            yield shown, mesh
        return
    with _realized(ob) as shown, _mesh_of(shown) as mesh:
        yield shown, mesh


@contextmanager
def _mesh_of(evaluated: Object) -> Iterator[Mesh]:
    try:
        yield evaluated.to_mesh()
    finally:
        evaluated.to_mesh_clear()


@contextmanager
def _realized(ob: Object) -> Iterator[Object]:
    """The evaluated copy of an object, with its instances in its mesh. It has no animation, which
    might hide it: what is animated is as it was on the object."""
    copy, nodes = ob.copy(), _realizing()
    try:
        copy.animation_data_clear()
        copy.hide_viewport = False
        for modifier in copy.modifiers:  # a pinned one would come after the last
            modifier.use_pin_to_last = False
        last = copy.modifiers.new(nodes.name, "NODES")
        last.node_group = nodes  # pyright: ignore[reportAttributeAccessIssue]
        bpy.context.scene.collection.objects.link(copy)
        yield copy.evaluated_get(bpy.context.evaluated_depsgraph_get())
    finally:
        bpy.data.objects.remove(copy)
        bpy.data.node_groups.remove(nodes)


def _realizing() -> NodeTree:
    """Geometry nodes that make instances a part of the mesh."""
    nodes = bpy.data.node_groups.new("Realize Instances", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        kind: Any = "NodeSocketGeometry"  # which the stubs do not know
        nodes.interface.new_socket("Geometry", in_out=side, socket_type=kind)
    kinds = ("NodeGroupInput", "GeometryNodeRealizeInstances", "NodeGroupOutput")
    given, realize, made = (nodes.nodes.new(kind) for kind in kinds)
    nodes.links.new(given.outputs[0], realize.inputs[0])
    nodes.links.new(realize.outputs[0], made.inputs[0])
    return nodes
