# SPDX-License-Identifier: GPL-3.0-or-later
"""The active field: what it was made from, how large and how good it is."""

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeGuard

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Mesh, Object, UILayout

from ...worker.client import JobKind
from ..layouts import draw_installation, draw_text
from ..locale.translations import OURS, translated
from ..scene.field_header import header_of
from ..scene.mesh import native_edits
from ..scene.properties import LOCAL, NETWORK, field_of, is_field, world_scale
from ..session import reports, worker_choice
from ..session.absorption import live
from ..session.worker_session import session
from ..viewport import worst_place
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
TURNED_ANGLES = {
    "untouched_normal_rms": n_("Untouched normals turned by"),
    "untouched_normal_max": n_("Untouched normals, worst"),
}
"""Angles of a report between the normals before and after, where the stroke was not."""

SHOWN_SHARES = {
    "beyond": (n_("Beyond the tolerance"), 0.0),
    "thin": (n_("Thinner than a cell"), 0.005),
}
"""Shares of a mesh, and the least of each that is shown."""
COUNTS = {
    "openings": n_("Openings closed"),
    "cavities": n_("Cavities"),
    "lost": n_("Pieces that are lost"),
}
MOST_NOTES = 8

PIECE_COUNTS = ("components", "components_after")
LINES = 9
"""Of a report of a stroke, with one that warns."""
SHORTEST_LENGTH = 1e-6
"""Meters. A shorter length is shown as less than this: Blender writes it as 0, or with more digits
than a line holds."""
NAME_WIDTH = 0.75
"""Of a line's width, for the name."""


class NEURAL_SCULPT_PT_model(Sidebar):
    """The active field, or the ways to get one."""

    bl_idname = "NEURAL_SCULPT_PT_model"
    bl_label = "Model"

    def draw(self, context: Context) -> None:
        """Draw the field, or the ways to get one."""
        layout = self.layout
        ob = context.active_object
        if is_field(ob):
            _draw_field(layout, context, ob)  # pyright: ignore[reportArgumentType]
        elif not worker_choice.has_worker():
            draw_installation(layout, context)  # pyright: ignore[reportArgumentType]
        else:
            layout.operator_menu_enum("neural_sculpt.add", "kind", icon="ADD")
            layout.operator("neural_sculpt.from_mesh", icon="MESH_MONKEY")
        for job in session.jobs:
            if job.kind in (JobKind.FIT, JobKind.LOAD, JobKind.CONSOLIDATE):
                draw_job(layout, job)  # pyright: ignore[reportArgumentType]
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
    """Quality of the last fit or stroke, as far as it is known. With strokes it has the same height
    before and after the measurement, so that buttons below it stay under the mouse.
    """
    column = layout.column(align=True)
    report = reports.report_of(ob)
    lines = [*_warnings(ob, report), *_measures(context, ob, report)]
    for line in lines:
        row = column.row(align=True)
        if line.value:  # which a narrow sidebar does not cut off
            split = row.split(factor=NAME_WIDTH)
            split.label(text=f"{line.name}:", icon=line.icon, translate=False)
            value = split.row()
            value.alignment = "RIGHT"
            value.label(text=line.value, translate=False)
        else:
            row.label(text=line.name, icon=line.icon, translate=False)
        if line.has_place:
            shown = worst_place.is_shown(ob)
            row.operator("neural_sculpt.show_worst", text="", icon="VIEWZOOM", depress=shown)
    for _ in range(len(lines), LINES if len(field_of(ob).strokes) else 0):
        column.label(text="")
    for note in reports.notes_of(report)[:MOST_NOTES]:
        draw_text(column, context, translated(note), "INFO")


class _Line(NamedTuple):
    """A line of the report, in the artist's language."""

    name: str
    value: str = ""
    icon: Any = "NONE"
    has_place: bool = False
    """Whether a button shows the place on the surface that it tells of."""


def _warnings(ob: Object, report: dict[str, Any]) -> Iterator[_Line]:
    """Why nothing is known, and what went wrong."""
    if reports.is_measured_now(ob):
        yield _Line(iface_("Measuring..."))
    elif not report and len(field_of(ob).strokes):
        yield _Line(iface_("Not measured"))
    if report.get("tolerance_met") is False:
        yield _Line(iface_("The last stroke was not fully reached"), icon="ERROR")
    before, after = report.get("components_before"), report.get("components_after")
    if _is_number(before) and _is_number(after) and before != after:
        text = iface_("Pieces: {} before the last stroke, {} now").format(before, after)
        yield _Line(text, icon="ERROR")


def _measures(context: Context, ob: Object, report: dict[str, Any]) -> Iterator[_Line]:
    """Lengths in scene units, shares and angles."""
    allowed = report.get("tolerance")
    for key, label in LENGTHS.items():
        if _is_number(value := report.get(key)):
            beyond = key in TOLERATED and _is_number(allowed) and value >= allowed
            length = _length(context, value * world_scale(ob))
            worst = key == "error_max" and bool(reports.worst_places(report))
            yield _Line(iface_(label), length, "ERROR" if beyond else "NONE", worst)
    yield from _lacks(report)
    if _is_number(gain := report.get("gain")):
        yield _Line(iface_("Height reached"), f"{gain:.1%}")
    if _is_number(angle := report.get("normal_deg")):
        yield _Line(iface_("Normals off by"), _degrees(angle, 1))
    for key, label in TURNED_ANGLES.items():  # how much the untouched surface looks different
        if _is_number(angle := report.get(key)):
            worst = key == "untouched_normal_max" and bool(reports.worst_places(report))
            yield _Line(iface_(label), _degrees(angle, 2), has_place=worst)
    if _is_number(share := report.get("sign_errors")) and share > 0:
        yield _Line(iface_("Volume on the wrong side"), f"{share:.2%}")
    for key in PIECE_COUNTS:
        if isinstance(value := report.get(key), int) and value > 1:
            yield _Line(iface_("Separate pieces"), str(value))


def _lacks(report: dict[str, Any]) -> Iterator[_Line]:
    """What a fit lacks of its mesh, and what it closed."""
    for key, (label, worth) in SHOWN_SHARES.items():
        if _is_number(share := report.get(key)) and share > worth:
            yield _Line(iface_(label), f"{share:.1%}")
    for key, label in COUNTS.items():
        if isinstance(count := report.get(key), int) and count > 0:
            yield _Line(iface_(label), str(count), "ERROR" if key == "lost" else "NONE")


def _degrees(angle: float, places: int) -> str:
    return f"{angle:.{places}f}\N{DEGREE SIGN}"


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _length(context: Context, value: float) -> str:
    """A length of the scene in its unit; one below SHORTEST_LENGTH as less than that."""
    units = context.scene.unit_settings
    if units.system == "NONE":
        return f"{value:.3g}"
    meters = value * units.scale_length
    text = bpy.utils.units.to_string(
        units.system,
        "LENGTH",
        SHORTEST_LENGTH if 0 < meters < SHORTEST_LENGTH else meters,
        precision=3,
        split_unit=False,
    )
    return f"< {text}" if 0 < meters < SHORTEST_LENGTH else text
