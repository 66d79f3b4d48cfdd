# SPDX-License-Identifier: GPL-3.0-or-later
"""Stand-in: a copy of a field's object with another mesh, while an exporter of Blender's writes it.

It has the place, the modifiers, the materials and the name of the object. It alone is selected, for
exporters take what is selected, and it is the active object, for some of them end the mode of that
one.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from bpy.types import ID, Mesh, Object

from ...scene.mesh import attributes, proxy_mesh
from ...scene.mesh.proxy_mesh import Geometry
from ...scene.undo_step import in_window


@contextmanager
def stand_in(ob: Object, geometry: Geometry) -> Iterator[Object]:
    """The stand-in of an object, with this mesh and what hangs on it, in a window's context."""
    with in_window():
        mesh = _mesh(ob, geometry)
        copy = ob.copy()
        try:
            _place(copy, mesh)
            if geometry.attributes is not None:
                attributes.write(copy, geometry.attributes)
            with _chosen(copy), _named(copy, ob), _named(mesh, proxy_mesh.mesh_of(ob)):
                yield copy
        finally:
            bpy.data.objects.remove(copy)
            bpy.data.meshes.remove(mesh)


def _mesh(ob: Object, geometry: Geometry) -> Mesh:
    """The geometry as a mesh with the materials of an object's own."""
    mesh = bpy.data.meshes.new(ob.name)
    proxy_mesh.fill(mesh, geometry)
    for material in proxy_mesh.mesh_of(ob).materials:
        mesh.materials.append(material)
    return mesh


def _place(copy: Object, mesh: Mesh) -> None:
    """Give a copy its mesh, and put it where exporters find it. It has no animation, which might
    hide it: what is animated is as it was on the object."""
    copy.data = mesh
    copy.animation_data_clear()
    copy.hide_viewport = copy.hide_select = False
    bpy.context.scene.collection.objects.link(copy)


@contextmanager
def _named(copy: ID, original: ID) -> Iterator[None]:
    """A copy has the name of the original while this block runs: exporters write it."""
    name = original.name
    try:
        if original.library is None:  # of another file, its name is free here
            original.name = "Neural Sculpt original"
        copy.name = name
        yield
    finally:
        copy.name = "Neural Sculpt copy"
        if original.library is None:
            original.name = name


@contextmanager
def _chosen(ob: Object) -> Iterator[None]:
    """An object alone is selected, and active, while this block runs."""
    selected, layer = [*(bpy.context.selected_objects or ())], bpy.context.view_layer
    active = layer.objects.active
    for other in selected:
        other.select_set(False)
    ob.select_set(True)
    layer.objects.active = ob
    try:
        yield
    finally:
        layer.objects.active = active
        for other in selected:
            other.select_set(True)
