# SPDX-License-Identifier: GPL-3.0-or-later
"""The status bar: what can be done now, how many strokes wait, and how far a slow job is.

Blender draws it again only when it is told so.
"""

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Header, STATUSBAR_HT_header

from ..locale.translations import OURS
from ..scene.chosen import holds_tool
from ..scene.properties import is_field
from ..session.worker_session import session
from .sidebar import draw_job

WIDTH = 16  # times the height of a button

KEY_HINTS: tuple[tuple[Any, str], ...] = (
    ("MOUSE_LMB", n_("Sculpt")),
    ("EVENT_CTRL", n_("Invert")),
    ("EVENT_SHIFT", n_("Smooth")),
    ("EVENT_P", n_("Control Points")),
    ("EVENT_F", n_("Radius")),
    ("EVENT_J", n_("Pick Stroke")),
)
"""What can be done with the tool: signs of keys, and words."""
WIDE_SIGNS = ("EVENT_CTRL",)
"""Signs that reach beyond their place."""


class _State:
    hint: str | None = None


def show_hint(hint: str | None) -> None:
    """Say what can be done; None leaves the text to Blender."""
    _State.hint = hint
    refresh()


def shown_hint() -> str | None:
    """The text that says what can be done; None when the text is Blender's own."""
    return _State.hint


def refresh() -> None:
    """Draw the status bars again.

    `WorkSpace.status_text_set` would do as well, but takes back what is added to the header. A
    timer may have no window in its context, without which Blender crashes here.
    """
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            window.workspace.status_text_set_internal(_State.hint)


def strokes_that_wait() -> int:
    """How many strokes have no result yet."""
    return sum(len(job.strokes) for job in session.jobs)


def _draw_keys(header: Header, context: Context) -> None:
    """Draw what the keys do while the tool is at rest, before what Blender draws."""
    if shown_hint() is not None or not is_field(context.active_object):
        return
    if not holds_tool(context.workspace, context.mode):
        return
    if all(area.type != "VIEW_3D" for area in context.window.screen.areas):
        return  # a file is chosen
    row = header.layout.row(align=True)
    for sign, text in KEY_HINTS:
        row.label(text="", icon=sign)
        if sign in WIDE_SIGNS:
            row.separator(factor=1.5)
        row.label(text=text, text_ctxt=OURS)


def _draw_slow_job(header: Header, context: Context) -> None:
    """Draw how far a slow job is and a button that cancels it, after what Blender draws."""
    if (count := strokes_that_wait()) > 1:
        text = iface_("{} strokes wait").format(count)
        header.layout.label(text=text, icon="SORTTIME", translate=False)
    if (job := session.slow_job()) is not None:
        row = header.layout.row()
        row.ui_units_x = WIDTH
        draw_job(row, job)


def register() -> None:
    """Add what is ours."""
    STATUSBAR_HT_header.prepend(_draw_keys)
    STATUSBAR_HT_header.append(_draw_slow_job)


def unregister() -> None:
    """Remove it."""
    STATUSBAR_HT_header.remove(_draw_slow_job)
    STATUSBAR_HT_header.remove(_draw_keys)
