# SPDX-License-Identifier: GPL-3.0-or-later
"""The status bar: what can be done now, and, as of Blender's own jobs, how far a slow job is.

Blender draws it again only when it is told so.
"""

# pyright: reportOptionalMemberAccess=false, reportAttributeAccessIssue=false

import bpy
from bpy.types import Context, Header, STATUSBAR_HT_header

from ..session.worker_session import session
from .sidebar import draw_job

WIDTH = 16  # times the height of a button


class _State:
    hint: str | None = None


def show_hint(hint: str | None) -> None:
    """Say what can be done; None leaves the text to Blender."""
    _State.hint = hint
    refresh()


def refresh() -> None:
    """Draw the status bars again.

    `WorkSpace.status_text_set` would do as well, but takes back what is added to the header. A
    timer may have no window in its context, without which Blender crashes here.
    """
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            window.workspace.status_text_set_internal(_State.hint)


def _draw_slow_job(header: Header, context: Context) -> None:
    """After what Blender draws: how far it is, and a button that cancels."""
    if (job := session.slow_job()) is not None:
        row = header.layout.row()
        row.ui_units_x = WIDTH
        draw_job(row, job)


def register() -> None:
    """Add the slow job."""
    STATUSBAR_HT_header.append(_draw_slow_job)


def unregister() -> None:
    """Remove it."""
    STATUSBAR_HT_header.remove(_draw_slow_job)
