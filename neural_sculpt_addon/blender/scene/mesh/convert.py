# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own conversion of attributes."""

import bpy
from bpy.types import Mesh, Object


def convert(ob: Object, name: str, **into: str) -> None:
    """Make something else of an attribute of an object's mesh, as Convert Attribute does."""
    assert isinstance(ob.data, Mesh)
    ob.data.attributes.active = ob.data.attributes[name]
    window = bpy.context.window_manager.windows[0]  # pyright: ignore[reportOptionalMemberAccess]
    with bpy.context.temp_override(window=window, object=ob, active_object=ob):
        bpy.ops.geometry.attribute_convert(**into)  # pyright: ignore[reportArgumentType]
