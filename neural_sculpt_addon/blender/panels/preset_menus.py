# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus beside the choice of a profile, modulation or alpha: save, rename, delete, import."""

import bpy
from bpy.types import Context, Menu, UILayout

from ..presets import curve_store

MOST_IMAGES = 32  # in a menu


def _draw(layout: UILayout, kind: str) -> None:
    for word, icon in (("save", "ADD"), ("rename", "SORTALPHA"), ("delete", "REMOVE")):
        layout.operator(f"neural_sculpt.{word}_preset", icon=icon).kind = kind  # pyright: ignore[reportArgumentType]
    layout.separator()
    layout.operator("neural_sculpt.import_preset", icon="IMPORT")
    layout.operator("neural_sculpt.open_presets", icon="FILE_FOLDER")


class NEURAL_SCULPT_MT_profile_presets(Menu):
    """Presets of the profile."""

    bl_idname = "NEURAL_SCULPT_MT_profile_presets"
    bl_label = "Profile Presets"

    def draw(self, context: Context) -> None:
        """Draw the entries."""
        _draw(self.layout, curve_store.PROFILE)  # pyright: ignore[reportArgumentType]


class NEURAL_SCULPT_MT_modulation_presets(Menu):
    """Presets of the modulation."""

    bl_idname = "NEURAL_SCULPT_MT_modulation_presets"
    bl_label = "Modulation Presets"

    def draw(self, context: Context) -> None:
        """Draw the entries."""
        _draw(self.layout, curve_store.MODULATION)  # pyright: ignore[reportArgumentType]


class NEURAL_SCULPT_MT_alpha_images(Menu):
    """Images for the alpha."""

    bl_idname = "NEURAL_SCULPT_MT_alpha_images"
    bl_label = "Alpha from Image"

    def draw(self, context: Context) -> None:
        """Draw the entries: a file, and the images of this scene."""
        layout, choose = self.layout, "neural_sculpt.alpha_image"
        layout.operator_context = "INVOKE_DEFAULT"
        layout.operator(choose, text="Open Image", icon="FILE_FOLDER")
        layout.separator()
        images = [image for image in bpy.data.images if image.type in {"IMAGE", "UV_TEST"}]
        for image in images[:MOST_IMAGES]:
            entry = layout.operator(choose, text=image.name, icon="IMAGE_DATA", translate=False)
            entry.image = image.name
