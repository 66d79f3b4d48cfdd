# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's own menus."""

import bpy
from bpy.types import Context, Menu

from .operators.fields.add import FILE


def draw_add(menu: Menu, context: Context) -> None:
    """Shift A, Neural Field."""
    menu.layout.operator_menu_enum(
        "neural_sculpt.add", "kind", text="Neural Field", icon="SHADING_RENDERED"
    )


def draw_convert(menu: Menu, context: Context) -> None:
    """Object, Convert, Neural Field from Mesh."""
    menu.layout.operator("neural_sculpt.from_mesh", icon="SHADING_RENDERED")


def draw_object(menu: Menu, context: Context) -> None:
    """Object, Neural Boolean, as Join is there."""
    menu.layout.operator("neural_sculpt.boolean", icon="MOD_BOOLEAN")


def draw_import(menu: Menu, context: Context) -> None:
    """File, Import, a field and strokes."""
    entry = menu.layout.operator("neural_sculpt.add", text="Neural Field (.safetensors, .pth)")
    entry.kind = FILE
    menu.layout.operator("neural_sculpt.strokes_from_file", text="Neural Strokes (.json)")


def draw_export(menu: Menu, context: Context) -> None:
    """File, Export, Neural Field."""
    menu.layout.operator(
        "neural_sculpt.export", text="Neural Field (.safetensors, .pth, .obj, .stl, .vdb, …)"
    )


_MENU_ITEMS = (
    ("VIEW3D_MT_add", draw_add),
    ("VIEW3D_MT_object_convert", draw_convert),
    ("VIEW3D_MT_object", draw_object),
    ("TOPBAR_MT_file_import", draw_import),
    ("TOPBAR_MT_file_export", draw_export),
)


def register() -> None:
    """Add the entries."""
    for menu, draw in _MENU_ITEMS:
        getattr(bpy.types, menu).append(draw)


def unregister() -> None:
    """Remove them."""
    for menu, draw in _MENU_ITEMS:
        getattr(bpy.types, menu).remove(draw)
