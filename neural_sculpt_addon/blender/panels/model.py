# SPDX-License-Identifier: GPL-3.0-or-later
"""The active field: what it was made from, how large and how good it is."""

from typing import Any, TypeGuard

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Mesh, Object, UILayout

from ...worker.client import JobKind
from .. import preferences
from ..locale.translations import OURS, translated
from ..scene import native_edits
from ..scene.field_header import header_of
from ..scene.properties import LOCAL, NETWORK, field_of, is_field, world_scale
from ..session import live, reports
from ..session.worker_session import session
from ..viewport import worst_place
from ..wrapped import draw_text
from .sidebar import Sidebar, draw_job

LENGTHS = {
    "error_mean": n_("Distance from the mesh"),
    "error_p95": n_("Distance from the mesh, 95 %"),
    "error_max": n_("Distance from the mesh, largest"),
    "distance_mean": n_("Lost by consolidating"),
    "distance_p95": n_("Lost by consolidating, 95 %"),
    "tube_mean": n_("Stroke error"),
    "tube_p95": n_("Stroke error, 95 %"),
    "reverse_p95": n_("Way back, 95 %"),
    "drift_mean": n_("Drift"),
}
"""Lengths of a report that are shown, in this order."""
TOLERATED = ("tube_p95", "reverse_p95")
"""Those that the report's tolerance bounds."""
TURNED = {
    "untouched_normal_rms": n_("Untouched normals turned by"),
    "untouched_normal_max": n_("Untouched normals, worst"),
}
"""Angles of a report between the normals before and after, where the stroke was not."""

SHARES = {
    "beyond": (n_("Beyond the tolerance"), 0.0),
    "thin": (n_("Thinner than a cell"), 0.005),
}
"""Shares of a mesh that are shown from so much on."""
COUNTS = {
    "openings": n_("Openings closed"),
    "cavities": n_("Cavities"),
    "lost": n_("Pieces that are lost"),
}
MOST_NOTES = 8

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
            _draw_field(layout, context, ob)
        elif not preferences.has_worker():
            preferences.draw_installation(layout, context)
        else:
            layout.operator_menu_enum("neural_sculpt.add", "kind", icon="ADD")
            layout.operator("neural_sculpt.from_mesh", icon="MESH_MONKEY")
        for job in session.jobs:
            if job.kind in (JobKind.FIT, JobKind.LOAD, JobKind.CONSOLIDATE):
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
    column.label(text=f"{iface_('Triangles', OURS)}: {triangles}", translate=False)
    if widths := header_of(ob).widths:
        units = " + ".join(map(str, widths))
        column.label(text=iface_("Network: {} units").format(units), translate=False)
    _draw_solver(layout, ob)
    if native_edits.edited(ob) and not live.is_on_its_way(ob):
        box = layout.column(align=True)
        box.label(text="Sculpted by other brushes", icon="ERROR")
        box.operator("neural_sculpt.absorb", icon="SCULPTMODE_HLT")
        box.prop(field_of(ob), "live")
    _draw_report(layout, context, ob)


def _draw_solver(layout: UILayout, ob: Object) -> None:
    """What strokes change, and the way to a plain network."""
    row = layout.row(align=True)
    for solver, title in ((LOCAL, n_("Detail")), (NETWORK, n_("Network"))):
        chosen = field_of(ob).solver == solver
        button = row.operator(
            "neural_sculpt.choose_solver", text=title, text_ctxt=OURS, depress=chosen
        )
        button.solver = solver
    row.operator("neural_sculpt.consolidate", text="", icon="OUTLINER_DATA_LATTICE")


def _draw_report(layout: UILayout, context: Context, ob: Object) -> None:
    """Quality of the last fit or stroke, in scene units, as far as it is known."""
    report = reports.report_of(ob)
    column = layout.column(align=True)
    if reports.is_measured_now(ob):
        column.label(text="Measuring...")
    if report.get("tolerance_met") is False:
        column.label(text="The last stroke was not fully reached", icon="ERROR")
    allowed = report.get("tolerance")
    before, after = report.get("components_before"), report.get("components_after")
    if _is_number(before) and _is_number(after) and before != after:
        text = iface_("Pieces: {} before the last stroke, {} now").format(before, after)
        column.label(text=text, icon="ERROR", translate=False)
    for key, label in LENGTHS.items():
        if _is_number(value := report.get(key)):
            text = f"{iface_(label)}: {_length(context, value * world_scale(ob))}"
            beyond = key in TOLERATED and _is_number(allowed) and value >= allowed
            row = column.row(align=True)
            row.label(text=text, icon="ERROR" if beyond else "NONE", translate=False)
            if key == "error_max":
                _draw_show_worst(row, ob, report)
    _draw_fit(column, context, report)
    if _is_number(gain := report.get("gain")):
        column.label(text=f"{iface_('Height reached')}: {gain:.1%}", translate=False)
    if _is_number(angle := report.get("normal_deg")):
        column.label(text=f"{iface_('Normals off by')}: {_degrees(angle, 1)}", translate=False)
    _draw_turned(column, ob, report)
    if _is_number(share := report.get("sign_errors")) and share > 0:
        column.label(text=f"{iface_('Volume on the wrong side')}: {share:.2%}", translate=False)
    for key in PIECES:
        if isinstance(value := report.get(key), int) and value > 1:
            column.label(text=f"{iface_('Separate pieces')}: {value}", translate=False)


def _draw_turned(column: UILayout, ob: Object, report: dict[str, Any]) -> None:
    """How much the untouched surface looks different, and a button that shows where most."""
    for key, label in TURNED.items():
        if _is_number(angle := report.get(key)):
            row = column.row(align=True)
            row.label(text=f"{iface_(label)}: {_degrees(angle, 2)}", translate=False)
            if key == "untouched_normal_max":
                _draw_show_worst(row, ob, report)


def _draw_show_worst(row: UILayout, ob: Object, report: dict[str, Any]) -> None:
    """The button that shows the worst places, if there are any."""
    if reports.worst_places(report):
        shown = worst_place.is_shown(ob)
        row.operator("neural_sculpt.show_worst", text="", icon="VIEWZOOM", depress=shown)


def _draw_fit(column: UILayout, context: Context, report: dict[str, Any]) -> None:
    """What a fit has of its mesh, and what it lacks."""
    for key, (label, worth) in SHARES.items():
        if _is_number(share := report.get(key)) and share > worth:
            column.label(text=f"{iface_(label)}: {share:.1%}", translate=False)
    for key, label in COUNTS.items():
        if isinstance(count := report.get(key), int) and count > 0:
            icon = "ERROR" if key == "lost" else "NONE"
            column.label(text=f"{iface_(label)}: {count}", icon=icon, translate=False)
    notes = report.get("notes")
    for note in notes[:MOST_NOTES] if isinstance(notes, list) else ():
        draw_text(column, context, translated(str(note)), "INFO")


def _degrees(angle: float, places: int) -> str:
    return f"{angle:.{places}f}\N{DEGREE SIGN}"


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _length(context: Context, value: float) -> str:
    units = context.scene.unit_settings
    if units.system == "NONE":
        return f"{value:.3g}"
    return bpy.utils.units.to_string(
        units.system, "LENGTH", value * units.scale_length, precision=3, split_unit=False
    )
