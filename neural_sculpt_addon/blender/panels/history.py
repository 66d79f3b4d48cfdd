# SPDX-License-Identifier: GPL-3.0-or-later
"""The strokes of the active field, in order, and what can be done with them."""

# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

from typing import Any

from bpy.types import Context, UILayout, UIList

from ...worker.client import JobKind
from ..scene import proxy_mesh, stroke_list
from ..scene.properties import LOCAL, NEURAL_SCULPT_PG_listed_stroke, field_of
from . import strength
from .sidebar import FieldSidebar, draw_job, job_of


class NEURAL_SCULPT_UL_strokes(UIList):
    """Strokes by name; a double click renames one."""

    bl_idname = "NEURAL_SCULPT_UL_strokes"

    def draw_item(
        self,
        context: Context,
        layout: UILayout,
        data: Any,
        item: NEURAL_SCULPT_PG_listed_stroke | None,
        icon: int | None,
        active_data: Any,
        active_property: str | None,
        index: int | None,
        flt_flag: int | None,
    ) -> None:
        """One stroke."""
        assert item is not None
        row = layout.row(align=True)
        name = row.row()
        name.active = not item.muted
        is_stroke = bool(item.data)
        sign = "CURVE_DATA" if is_stroke else "SCULPTMODE_HLT"
        alone = len(data.strokes) > 1 and [s.uid for s in data.strokes if not s.muted] == [item.uid]
        name.prop(item, "name", text="", emboss=False, icon=sign)
        for operator, sign in (
            *((("edit_stroke", "GREASEPENCIL"),) if is_stroke else ()),
            ("solo_stroke", "SOLO_ON" if alone else "SOLO_OFF"),
            ("mute_stroke", "HIDE_ON" if item.muted else "HIDE_OFF"),
        ):
            button = row.operator(f"neural_sculpt.{operator}", text="", icon=sign, emboss=False)
            button.uid = item.uid


class NEURAL_SCULPT_PT_history(FieldSidebar):
    """The strokes of the active field."""

    bl_idname = "NEURAL_SCULPT_PT_history"
    bl_label = "History"

    def draw(self, context: Context) -> None:
        """Draw the list and its buttons."""
        layout = self.layout
        group = field_of(context.active_object)
        row = layout.row()
        row.template_list(
            NEURAL_SCULPT_UL_strokes.bl_idname, "", group, "strokes", group, "active_stroke", rows=5
        )
        column = row.column(align=True)
        column.operator("neural_sculpt.duplicate_stroke", text="", icon="DUPLICATE")
        column.operator("neural_sculpt.delete_stroke", text="", icon="REMOVE")
        column.separator()
        for direction in ("UP", "DOWN"):
            button = column.operator("neural_sculpt.move_stroke", text="", icon=f"TRIA_{direction}")
            button.direction = direction
        if uid := stroke_list.active_uid(context.active_object):
            if group.solver == LOCAL:
                slider = layout.row()
                slider.enabled = not proxy_mesh.why_locked(context.active_object)
                slider.prop(context.window_manager, strength.NAME, slider=True)
            if group.strokes[group.active_stroke].data:
                points = layout.operator(
                    "neural_sculpt.draw", text="Edit Points", icon="CURVE_DATA"
                )
                points.uid = uid
        if (job := job_of(context)) is not None and job.kind in (JobKind.REPLAY, JobKind.FLATTEN):
            draw_job(layout, job)
        layout.operator("neural_sculpt.apply_to_base", icon="CHECKMARK")
