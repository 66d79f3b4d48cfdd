# SPDX-License-Identifier: GPL-3.0-or-later
"""The strokes of the active field, in order, and what can be done with them."""

import json
from typing import Any

import numpy as np
from bpy.types import Context, UILayout, UIList

from ...stroke.stroke import Kind
from ...worker.client import JobKind
from ..presets import thumbnails
from ..scene import stroke_list
from ..scene.mesh import proxy_mesh
from ..scene.properties import (
    LOCAL,
    NEURAL_SCULPT_PG_field,
    NEURAL_SCULPT_PG_listed_stroke,
    field_of,
)
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
        name.prop(item, "name", text="", emboss=False, **_picture(item))
        edit, solo = ("edit_stroke", EDIT), ("solo_stroke", _star(data, item.uid))
        others = () if _is_narrow(context) else (edit, solo) if is_stroke else (solo,)
        for operator, sign in (*others, ("mute_stroke", "HIDE_ON" if item.muted else "HIDE_OFF")):
            button = row.operator(f"neural_sculpt.{operator}", text="", icon=sign, emboss=False)  # pyright: ignore[reportArgumentType]
            button.uid = item.uid


EDIT = "GREASEPENCIL"

NARROW_SIDEBAR = 240
"""Width of a sidebar in pixels, at the normal size of the interface. In a narrower one some of the
buttons move from beside the names to below the list, so that the names can be read."""

SIGNS = {Kind.SMOOTH: "MOD_SMOOTH", Kind.FLATTEN: "MESH_PLANE", Kind.PINCH: "MOD_CAST"}
"""As in the list of kinds."""


def _star(group: NEURAL_SCULPT_PG_field, uid: str) -> Any:
    """The sign of Solo: filled when all other entries are muted."""
    alone = len(group.strokes) > 1 and [s.uid for s in group.strokes if not s.muted] == [uid]
    return "SOLO_ON" if alone else "SOLO_OFF"


def _is_narrow(context: Context) -> bool:
    return context.region.width < NARROW_SIDEBAR * context.preferences.system.ui_scale


def _picture(item: NEURAL_SCULPT_PG_listed_stroke) -> dict[str, Any]:
    """The picture of an entry: the profile of a brush that draws, upside down where it carves;
    otherwise the icon of its kind, or of Sculpt Mode."""
    stroke = stroke_list.shown(item)
    if stroke is None:
        return {"icon": "SCULPTMODE_HLT"}
    if stroke.kind is not Kind.DRAW:
        return {"icon": SIGNS[stroke.kind]}
    profile, down = stroke.brush.profile, stroke.brush.intensity < 0
    values = profile(np.linspace(*profile.DOMAIN, 129)[::-1])
    key = f"entry {json.dumps(profile.to_json())} {down}"
    number = thumbnails.icon(key, profile.WORD, -values if down else values)
    return {"icon_value": number} if number else {"icon": "BRUSH_DATA"}


class NEURAL_SCULPT_PT_history(FieldSidebar):
    """The strokes of the active field."""

    bl_idname = "NEURAL_SCULPT_PT_history"
    bl_label = "History"

    def draw(self, context: Context) -> None:
        """Draw the list and its buttons."""
        layout = self.layout
        group = field_of(context.active_object)  # pyright: ignore[reportArgumentType]
        narrow = _is_narrow(context)
        both = layout.column() if narrow else layout.row()
        both.template_list(
            NEURAL_SCULPT_UL_strokes.bl_idname, "", group, "strokes", group, "active_stroke", rows=5
        )
        buttons = both.row(align=True) if narrow else both.column(align=True)
        if narrow:
            buttons.operator("neural_sculpt.edit_stroke", text="", icon=EDIT)
            star = _star(group, stroke_list.active_uid(context.active_object))  # pyright: ignore[reportArgumentType]
            buttons.operator("neural_sculpt.solo_stroke", text="", icon=star)
        buttons.operator("neural_sculpt.duplicate_stroke", text="", icon="DUPLICATE")
        buttons.operator("neural_sculpt.delete_stroke", text="", icon="REMOVE")
        buttons.separator()
        for direction in ("UP", "DOWN"):
            button = buttons.operator(
                "neural_sculpt.move_stroke",
                text="",
                icon=f"TRIA_{direction}",  # pyright: ignore[reportArgumentType]
            )
            button.direction = direction
        if uid := stroke_list.active_uid(context.active_object):  # pyright: ignore[reportArgumentType]
            if group.solver == LOCAL:
                slider = layout.row()
                slider.enabled = not proxy_mesh.why_locked(context.active_object)  # pyright: ignore[reportArgumentType]
                slider.prop(context.window_manager, strength.PROPERTY, slider=True)
            if group.strokes[group.active_stroke].data:
                points = layout.operator(
                    "neural_sculpt.draw", text="Edit Points", icon="CURVE_DATA"
                )
                points.uid = uid
        job = job_of(context)
        if job is not None and job.kind in (JobKind.REPLAY, JobKind.APPLY_TO_BASE):
            draw_job(layout, job)  # pyright: ignore[reportArgumentType]
        layout.operator("neural_sculpt.apply_to_base", icon="CHECKMARK")
