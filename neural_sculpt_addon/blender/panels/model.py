# SPDX-License-Identifier: GPL-3.0-or-later
"""The active field: what it was made from, how large and how good it is."""

import json

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Mesh, Object, UILayout

from ...worker.client import JobKind
from .. import native_edits, preferences
from ..properties import field_of, is_field, world_scale
from ..worker_session import session
from .sidebar import Sidebar, draw_job

LENGTHS = {
    "error_mean": n_("Distance from the mesh"),
    "error_p95": n_("Distance from the mesh, 95 %"),
    "error_max": n_("Distance from the mesh, largest"),
    "tube_mean": n_("Stroke error"),
    "tube_p95": n_("Stroke error, 95 %"),
    "drift_mean": n_("Drift"),
}
"""Lengths of a report that are shown, in this order."""

# pyright: reportOptionalMemberAccess=false, reportArgumentType=false
PIECES = ("components", "components_after")


class NEURAL_SCULPT_PT_model(Sidebar):
    """The active field, or the ways to get one."""

    bl_idname = "NEURAL_SCULPT_PT_model"
    bl_label = "Model"

    def draw(self, context: Context) -> None:
        """Draw the field, or the ways to get one."""
        layout = self.layout
        ob = context.active_object
        if is_field(ob):
            assert ob is not None
            _draw_field(layout, context, ob)
        elif not preferences.has_worker():
            preferences.draw_installation(layout, context)
        else:
            layout.operator_menu_enum("neural_sculpt.add", "kind", icon="ADD")
            layout.operator("neural_sculpt.from_mesh", icon="MESH_MONKEY")
        for job in session.jobs:
            if job.kind in (JobKind.FIT, JobKind.LOAD):
                draw_job(layout, job)
                if job.preview is not None:
                    layout.operator("neural_sculpt.good_enough", icon="CHECKMARK")


def _draw_field(layout: UILayout, context: Context, ob: Object) -> None:
    group = field_of(ob)
    column = layout.column(align=True)
    title = iface_("{}, from {}").format(ob.name, group.source)
    column.label(text=title, icon="SHADING_RENDERED", translate=False)
    sizes = " x ".join(_length(context, size) for size in ob.dimensions)
    column.label(text=f"{iface_('Size')}: {sizes}", translate=False)
    assert isinstance(ob.data, Mesh)
    triangles = f"{len(ob.data.polygons):,}"
    column.label(text=f"{iface_('Triangles')}: {triangles}", translate=False)
    if widths := network_widths(group.weights):
        units = " + ".join(map(str, widths))
        column.label(text=iface_("Network: {} units").format(units), translate=False)
    if native_edits.edited(ob):
        box = layout.column(align=True)
        box.label(text="Sculpted by other brushes", icon="ERROR")
        box.operator("neural_sculpt.absorb", icon="SCULPTMODE_HLT")
    _draw_report(layout, context, ob)


def _draw_report(layout: UILayout, context: Context, ob: Object) -> None:
    """Quality of the last fit or stroke, in scene units."""
    report = json.loads(field_of(ob).report or "{}")
    column = layout.column(align=True)
    if report.get("tolerance_met") is False:
        column.label(text="The last stroke was not fully reached", icon="ERROR")
    before, after = report.get("components_before"), report.get("components_after")
    if before != after:
        text = iface_("Pieces: {} before the last stroke, {} now").format(before, after)
        column.label(text=text, icon="ERROR", translate=False)
    for key, label in LENGTHS.items():
        if isinstance(value := report.get(key), int | float):
            length = _length(context, value * world_scale(ob))
            column.label(text=f"{iface_(label)}: {length}", translate=False)
    if isinstance(angle := report.get("normal_deg"), int | float):
        column.label(
            text=f"{iface_('Normals off by')}: {angle:.1f}\N{DEGREE SIGN}", translate=False
        )
    if isinstance(share := report.get("sign_errors"), int | float) and share > 0:
        column.label(text=f"{iface_('Volume on the wrong side')}: {share:.2%}", translate=False)
    for key in PIECES:
        if isinstance(value := report.get(key), int) and value > 1:
            column.label(text=f"{iface_('Separate pieces')}: {value}", translate=False)


def network_widths(weights: bytes) -> list[int]:
    """Units of the inner layers, by the head of a safetensors file; none when it is damaged."""
    try:
        tensors = json.loads(weights[8 : 8 + int.from_bytes(weights[:8], "little")])
        biases = (tensors[f"layers.{layer}.bias"] for layer in range(len(tensors) // 2 - 1))
        return [int(bias["shape"][0]) for bias in biases]
    except (ValueError, KeyError, TypeError, IndexError, RecursionError):
        return []


def _length(context: Context, value: float) -> str:
    units = context.scene.unit_settings
    if units.system == "NONE":
        return f"{value:.3g}"
    return bpy.utils.units.to_string(
        units.system, "LENGTH", value * units.scale_length, precision=3, split_unit=False
    )
