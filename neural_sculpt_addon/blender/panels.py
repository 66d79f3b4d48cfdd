# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar of the 3D viewport: model, brush, status."""

# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

import json

from bpy.types import Context, Panel, UILayout

from ..stroke.errors import SculptError
from . import curve_store, preferences
from .properties import CURVE, NEURAL_SCULPT_PG_brush, brush_of, field_of, is_field
from .worker_session import session

REPORT = {
    "tube_mean": "Tube error, mean",
    "tube_p95": "Tube error, 95 %",
    "drift_mean": "Drift, mean",
    "seconds": "Seconds",
}
"""Numbers of a report that are shown, in this order."""


class _Sidebar(Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Neural Sculpt"


class NEURAL_SCULPT_PT_model(_Sidebar):
    """The active field: what it was made from, how large and how good it is."""

    bl_idname = "NEURAL_SCULPT_PT_model"
    bl_label = "Model"

    def draw(self, context: Context) -> None:
        """Draw the field, or the ways to get one."""
        layout = self.layout
        ob = context.active_object
        if not is_field(ob):
            layout.operator_menu_enum("neural_sculpt.add", "kind", icon="ADD")
            layout.operator("neural_sculpt.from_mesh", icon="MESH_MONKEY")
            return
        assert ob is not None
        group = field_of(ob)
        column = layout.column(align=True)
        column.label(text=f"{ob.name}, from {group.source}", icon="SHADING_RENDERED")
        column.label(text="Size " + " x ".join(f"{length:.3g}" for length in ob.dimensions))
        _draw_report(column, group.report)
        row = layout.row(align=True)
        row.operator("neural_sculpt.remesh", icon="MOD_REMESH")
        row.operator("neural_sculpt.export", text="Export", icon="EXPORT")


class NEURAL_SCULPT_PT_brush(_Sidebar):
    """The brush of the next stroke."""

    bl_idname = "NEURAL_SCULPT_PT_brush"
    bl_label = "Brush"

    def draw(self, context: Context) -> None:
        """Draw the brush and its curves."""
        layout = self.layout
        brush = brush_of(context)
        column = layout.column(align=True)
        column.prop(brush, "scene_radius")
        column.prop(brush, "scene_intensity")
        _draw_shape(layout, brush, curve_store.PROFILE)
        _draw_shape(layout, brush, curve_store.MODULATION)
        layout.operator("neural_sculpt.stroke", text="Draw Stroke", icon="GREASEPENCIL")


class NEURAL_SCULPT_PT_status(_Sidebar):
    """What the worker does, and what went wrong last."""

    bl_idname = "NEURAL_SCULPT_PT_status"
    bl_label = "Status"

    def draw(self, context: Context) -> None:
        """Draw the worker's state, progress and last error."""
        layout = self.layout
        try:
            preferences.worker_python()
        except SculptError:
            preferences.draw_installation(layout)
            return
        row = layout.row()
        row.label(text=session.describe_worker(), icon="SYSTEM")
        row.operator("neural_sculpt.restart_worker", text="", icon="FILE_REFRESH")
        if session.jobs:
            job = session.jobs[0]
            text = f"{job.label}: {job.message}" if job.message else job.label
            row = layout.row(align=True)
            row.progress(factor=job.fraction, text=text)
            row.operator("neural_sculpt.cancel", text="", icon="CANCEL")
            if waiting := len(session.jobs) - 1:
                layout.label(text=f"{waiting} waiting")
        if session.last_error:
            column = layout.column(align=True)
            column.alert = True
            for number, sentence in enumerate(session.last_error.split(". ")):
                column.label(text=sentence, icon="NONE" if number else "ERROR")


def _draw_shape(layout: UILayout, brush: NEURAL_SCULPT_PG_brush, word: str) -> None:
    layout.label(text=word.title())
    layout.prop(brush, word, text="")
    if getattr(brush, word) == CURVE and brush.curves is not None:
        layout.template_curve_mapping(brush.curves.nodes[word], "mapping")


def _draw_report(layout: UILayout, text: str) -> None:
    report = json.loads(text or "{}")
    if report.get("tolerance_met") is False:
        layout.label(text="The last stroke was not fully reached", icon="ERROR")
    for key, label in REPORT.items():
        if isinstance(value := report.get(key), int | float):
            layout.label(text=f"{label}: {value:.3g}")
