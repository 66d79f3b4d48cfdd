# SPDX-License-Identifier: GPL-3.0-or-later
"""A field takes the place of the object that it was fitted to: its collections and parent, its
settings and custom properties. What stays with that object is told by `left_behind`.
"""

from collections.abc import Callable
from contextlib import suppress

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import ID, Collection, Mesh, Object

from .properties import GROUP

NO_DEFORMING = {"ARMATURE", "LATTICE"}
"""Types of parents that also deform their child. The fitted shape has that deformation already."""
OF_VERTICES = {"VERTEX", "VERTEX_3"}
"""Types of parents of which vertices carry their child."""

SETTINGS = (
    "color",
    "pass_index",
    "rotation_mode",
    "display_type",
    "show_in_front",
    "show_name",
    "show_axis",
    "show_wire",
    "show_bounds",
    "display_bounds_type",
    "hide_select",
    "lock_location",
    "lock_rotation",
    "lock_rotation_w",
    "lock_rotations_4d",
    "lock_scale",
    "visible_camera",
    "visible_diffuse",
    "visible_glossy",
    "visible_transmission",
    "visible_volume_scatter",
    "visible_shadow",
    "is_shadow_catcher",
    "is_holdout",
)
"""Properties of an object that have nothing to do with its shape."""


def link(ob: Object, like: Object | None, scene: int) -> None:
    """Put an object into the collections of another one that is in the view layer, or in another
    scene, and else into the active collection, or into the scene of that session_uid if another
    one is shown. Where these are linked they take nothing in: then the scene's own does.
    """
    context = bpy.context
    places = like.users_collection if like is not None and _has_place(like) else ()
    meant = next((s for s in bpy.data.scenes if s.session_uid == scene), context.scene)
    active = context.collection if meant == context.scene else meant.collection
    others = active, meant.collection, context.scene.collection
    for collection in [*filter(_is_own, places)] or [*filter(_is_own, others)][:1]:
        collection.objects.link(ob)


def _has_place(ob: Object) -> bool:
    """Whether an object is in the view layer, or in other scenes than the one in the window."""
    scenes, shown = ob.users_scene, bpy.context.scene
    return ob.name in bpy.context.view_layer.objects or (bool(scenes) and shown not in scenes)


def _is_own(collection: Collection) -> bool:
    """Whether a collection belongs to this file, which can put objects into it."""
    return collection.library is None and collection.override_library is None


def inherit(ob: Object, like: Object) -> None:
    """Give an object what hangs on another one; its place in the world stays."""
    for name in SETTINGS:
        setattr(ob, name, getattr(like, name))
    _take_custom(ob, like)
    assert ob.data is not None
    assert like.data is not None
    _take_custom(ob.data, like.data)
    if like.parent is not None:
        _follow(ob, like)


def _take_custom(block: ID, like: ID) -> None:
    """Give a data-block the custom properties of another, but for those of fields."""
    registered = type(block).bl_rna.properties
    for key in like.keys():  # noqa: SIM118 - a data-block is no mapping
        if key in registered or key.startswith(GROUP):
            continue
        value = like[key]
        block[key] = value.to_dict() if hasattr(value, "to_dict") else value
        with suppress(TypeError):  # groups and lists of groups have no settings
            described = like.id_properties_ui(key).as_dict()  # pyright: ignore[reportAttributeAccessIssue]
            block.id_properties_ui(key).update(**described)  # pyright: ignore[reportAttributeAccessIssue]


def _follow(ob: Object, like: Object) -> None:
    """Give an object the parent of another, unless its uneven scale would distort it."""
    place = ob.matrix_world.copy()
    ob.parent, ob.parent_bone = like.parent, like.parent_bone
    ob.parent_type = "OBJECT" if like.parent_type in NO_DEFORMING else like.parent_type
    ob.parent_vertices = like.parent_vertices
    ob.matrix_parent_inverse = like.matrix_parent_inverse
    if like.parent_type in OF_VERTICES:  # which Blender finds in an evaluated scene only
        carried = like.matrix_world @ like.matrix_basis.inverted_safe()
        ob.matrix_basis = carried.inverted_safe() @ place
    else:
        ob.matrix_world = place
    bpy.context.view_layer.update()
    size = max(np.abs(np.array(place)).max(), 1e-12)
    if np.abs(np.array(ob.matrix_world) - np.array(place)).max() > 1e-4 * size:
        ob.parent = None
        ob.matrix_world = place


def left_behind(ob: Object) -> str:
    """The things that stay with a mesh object when it becomes a field, in the artist's language."""
    return ", ".join(iface_(name) for name, has in _LEFT.items() if has(ob))


def has_maps(ob: Object) -> bool:
    """Whether the object has UV maps, of which seams are rough on a field."""
    return isinstance(ob.data, Mesh) and len(ob.data.uv_layers) > 0


def _mesh(ob: Object) -> Mesh:
    assert isinstance(ob.data, Mesh)
    return ob.data


def _names(*names: str) -> Callable[[Object], bool]:
    """Whether the mesh has an attribute of one of these names."""
    return lambda ob: any(name in _mesh(ob).attributes for name in names)


def _has_others(ob: Object) -> bool:
    """Whether the mesh has attributes of edges or of text, beside those with names of their own."""
    named = "crease_edge", "bevel_weight_edge", "uv_seam", "sharp_edge"
    others = (each for each in _mesh(ob).attributes if not each.name.startswith("."))
    return any(
        each.data_type == "STRING" or (each.domain == "EDGE" and each.name not in named)
        for each in others
    )


def _has_deltas(ob: Object) -> bool:
    """Whether the object has a delta location or rotation. A field has a delta scale of its own."""
    turn = *ob.delta_rotation_euler, *ob.delta_rotation_quaternion[1:]
    return any((*ob.delta_location, *turn))


_LEFT: dict[str, Callable[[Object], bool]] = {
    n_("shape keys"): lambda ob: _mesh(ob).shape_keys is not None,
    n_("modifiers"): lambda ob: len(ob.modifiers) > 0,
    n_("constraints"): lambda ob: len(ob.constraints) > 0,
    n_("animation"): lambda ob: ob.animation_data is not None,
    n_("children"): lambda ob: len(ob.children) > 0,
    n_("custom normals"): lambda ob: _mesh(ob).has_custom_normals,
    n_("creases"): _names("crease_edge", "crease_vert"),
    n_("bevel weights"): _names("bevel_weight_edge", "bevel_weight_vert"),
    n_("marked seams"): _names("uv_seam", ".uv_seam"),
    n_("sharp edges"): _names("sharp_edge"),
    n_("masks and face sets"): _names(".sculpt_mask", ".sculpt_face_set"),
    n_("attributes of edges or of text"): _has_others,
    n_("rigid body physics"): lambda ob: ob.rigid_body is not None,
    n_("delta transforms"): _has_deltas,
}
"""All of it stays with the mesh, modifiers with what they do: the field has their result."""
