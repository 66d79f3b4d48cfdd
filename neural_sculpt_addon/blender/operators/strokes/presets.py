# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's own presets of the curve widgets: save, rename, delete, import."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.props import EnumProperty, StringProperty
from bpy.types import Context, Event, Operator

from ....common.errors import SculptError
from ....interaction.preset_file import LONGEST_NAME, Preset
from ...locale.translations import OURS
from ...presets import curve_store, presets
from ...presets.shape_choices import CURVE
from ...scene.brush.brush_properties import brush_of
from ..job_operator import FINISHED, REGISTER, Outcome, refuse, reports_errors


def _kind_property() -> Any:
    return EnumProperty(
        name="Kind",
        description="Of which curve widget the preset is",
        items=[
            (curve_store.PROFILE, "Profile", "Cross-section of the stroke"),
            (curve_store.MODULATION, "Modulation", "Strength along the stroke"),
        ],
        options={"HIDDEN", "SKIP_SAVE"},
    )


def _name_property() -> Any:
    return StringProperty(
        name="Name", description="Of the preset", maxlen=LONGEST_NAME, options={"SKIP_SAVE"}
    )


_items: list[tuple[str, str, str]] = []  # Blender does not copy the texts


def _own_items(operator: Any, context: Context | None) -> list[tuple[str, str, str]]:
    _items[:] = [
        (stem, preset.name, "") for stem, preset in presets.own(operator.kind).items()
    ] or [("NONE", iface_("No presets of your own yet"), "")]
    return _items


class _PresetOperator(Operator):
    bl_options = REGISTER

    kind: _kind_property()

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for what is not given."""
        return context.window_manager.invoke_props_dialog(self)


class _OwnOperator(_PresetOperator):
    preset: EnumProperty(
        name="Preset", description="One of your own", items=_own_items, translation_context=OURS
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        """The artist has presets."""
        if presets.own(curve_store.PROFILE) or presets.own(curve_store.MODULATION):
            return True
        return refuse(cls, "No presets of your own yet")

    def _chosen(self) -> Preset:
        if (known := presets.own(self.kind).get(self.preset)) is None:
            raise SculptError("There is no such preset. Save one first.")
        return known


class NEURAL_SCULPT_OT_save_preset(_PresetOperator):
    """Save what the curve widget shows as a preset"""

    bl_idname = "neural_sculpt.save_preset"
    bl_label = "Save Preset"

    name: _name_property()

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Write it; one of the same name is replaced."""
        brush = brush_of(context)
        if getattr(brush, self.kind) != CURVE:
            raise SculptError("Only a curve can be saved. Choose Curve and shape it first.")
        presets.save(curve_store.preset(self.kind, self.name))
        return FINISHED


class NEURAL_SCULPT_OT_rename_preset(_OwnOperator):
    """Give a preset of your own another name"""

    bl_idname = "neural_sculpt.rename_preset"
    bl_label = "Rename Preset"

    name: _name_property()

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Write it under the new name, which no other preset may have, and delete the old file."""
        renamed, before = replace(self._chosen(), name=self.name), self.preset
        presets.refuse_taken(renamed, before)
        if presets.save(renamed) != before:  # by now `self.preset` may be another one
            presets.delete(before)
        return FINISHED


class NEURAL_SCULPT_OT_delete_preset(_OwnOperator):
    """Delete a preset of your own"""

    bl_idname = "neural_sculpt.delete_preset"
    bl_label = "Delete Preset"

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Delete its file."""
        self._chosen()
        presets.delete(self.preset)
        return FINISHED


class NEURAL_SCULPT_OT_import_preset(Operator):
    """Add a preset from a file that somebody shared"""

    bl_idname = "neural_sculpt.import_preset"
    bl_label = "Import Preset"
    bl_options = REGISTER

    filepath: StringProperty(
        name="File",
        description="A preset file that somebody shared",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for the file."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Read it strictly, and write it among the others, none of which it may replace."""
        preset = presets.read(Path(bpy.path.abspath(self.filepath)))
        presets.refuse_taken(preset)
        presets.save(preset)
        return FINISHED
