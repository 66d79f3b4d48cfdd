# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be done with presets, beside the choice of a profile or modulation."""

# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

from bpy.types import Context, Menu, UILayout

from ..presets import curve_store


def _draw(layout: UILayout, kind: str) -> None:
    for word, icon in (("save", "ADD"), ("rename", "SORTALPHA"), ("delete", "REMOVE")):
        layout.operator(f"neural_sculpt.{word}_preset", icon=icon).kind = kind
    layout.separator()
    layout.operator("neural_sculpt.import_preset", icon="IMPORT")
    layout.operator("neural_sculpt.open_presets", icon="FILE_FOLDER")


class NEURAL_SCULPT_MT_profile_presets(Menu):
    """Presets of the profile."""

    bl_idname = "NEURAL_SCULPT_MT_profile_presets"
    bl_label = "Profile Presets"

    def draw(self, context: Context) -> None:
        """Draw the entries."""
        _draw(self.layout, curve_store.PROFILE)


class NEURAL_SCULPT_MT_modulation_presets(Menu):
    """Presets of the modulation."""

    bl_idname = "NEURAL_SCULPT_MT_modulation_presets"
    bl_label = "Modulation Presets"

    def draw(self, context: Context) -> None:
        """Draw the entries."""
        _draw(self.layout, curve_store.MODULATION)
