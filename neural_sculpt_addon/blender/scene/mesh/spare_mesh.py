# SPDX-License-Identifier: GPL-3.0-or-later
"""Spare mesh: the next proxy, made ready in pieces beside the mesh that an object shows, and then
put in its place.

Whatever changes a mesh that is shown in Sculpt Mode, Blender evaluates it before it hears the
artist again. With 100,000 vertices that takes 15 ms to sort the triangles for its brushes, 8 for
the normals of the vertices, and to fill it takes 6 more. A spare mesh belongs to no object, so
nothing is evaluated while it is filled, and the normals that it knows are known where it is put.

Nothing refers to it, so no file gets it. A step of something else that is pushed meanwhile has it,
though, for Blender's history has all data-blocks: undo to that step would bring it back, for
nobody. It is marked, and swept away then.
"""

from collections.abc import Callable

import bpy
from bpy.types import Mesh, Object

from . import attributes, proxy_mesh
from .proxy_mesh import Geometry, mesh_of

SPARE = "neural_sculpt_spare"
"""Custom property of a spare mesh."""


class SpareMesh:
    """What is to become the mesh of an object. No reference to it is kept, for undo may come
    between two pieces of work; Blender then has it no more, or it is dropped.

    sculpted: whether it is to be shown in Sculpt Mode, where Blender needs the vertices' normals
    """

    def __init__(self, new: Geometry, sculpted: bool) -> None:
        """Nothing is made yet."""
        self._new = new
        dress = () if new.attributes is None else (self._dress,)
        normals = (self._find_normals,) if sculpted else ()
        pieces = self._resize, self._shape, *dress, *normals, self._shade
        self._pieces: list[Callable[[Mesh], None]] = [*pieces]
        self._uid = 0

    @property
    def is_there(self) -> bool:
        """Whether it can still be worked at: something may have removed what no object has."""
        return not self._uid or _find(self._uid) is not None

    @property
    def is_done(self) -> bool:
        """Whether it can be shown."""
        return not self._pieces

    def work(self, ob: Object) -> bool:
        """Do a piece of the work, of some 10 ms at most; False when there was none left. `ob` is
        the object that will show it, and must not have been changed meanwhile."""
        if not self._pieces:
            return False
        if not self._uid:
            mesh = mesh_of(ob).copy()
            mesh[SPARE] = True
            self._uid = mesh.session_uid
        self._pieces.pop(0)(self._found())
        return True

    def show(self, ob: Object) -> None:
        """Let an object show it, when all pieces are done: it takes the place of the object's mesh,
        and its name, wherever Blender refers to that. The mesh before stays as an empty one until
        it is swept away. No other object may use it. Nothing is evaluated before all of this is
        done, and so it is once."""
        spare, old = self._found(), mesh_of(ob)
        name = old.name
        del spare[SPARE]
        old.user_remap(spare)
        old.clear_geometry()
        old[SPARE], old.name = True, f"{name} before"
        spare.name = name

    def _found(self) -> Mesh:
        mesh = _find(self._uid)
        assert mesh is not None
        return mesh

    def _resize(self, mesh: Mesh) -> None:
        proxy_mesh.resize(mesh, self._new)

    def _shape(self, mesh: Mesh) -> None:
        proxy_mesh.shape(mesh, self._new)
        mesh.update()

    def _dress(self, mesh: Mesh) -> None:
        """Blender writes vertex groups and converts attributes by way of an object."""
        holder = bpy.data.objects.new(mesh.name, mesh)
        assert self._new.attributes is not None
        attributes.write(holder, self._new.attributes)
        bpy.data.objects.remove(holder)

    def _find_normals(self, mesh: Mesh) -> None:
        """The vertices' own come before those that are to be shown: with these Blender finds its
        own no earlier than it needs them."""
        for normal in mesh.vertex_normals[:1]:
            _ = normal.vector

    def _shade(self, mesh: Mesh) -> None:
        proxy_mesh.shade(mesh, self._new)


def sweep() -> None:
    """Remove all spare meshes: none is wanted."""
    for mesh in [mesh for mesh in bpy.data.meshes if SPARE in mesh and not mesh.users]:
        bpy.data.meshes.remove(mesh)


def _find(uid: int) -> Mesh | None:
    return next((mesh for mesh in bpy.data.meshes if mesh.session_uid == uid), None)
