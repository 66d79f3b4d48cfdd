# SPDX-License-Identifier: GPL-3.0-or-later
"""In the status bar, as of Blender's own jobs: how far a slow job is, and a button that cancels."""

# pyright: reportOptionalMemberAccess=false

from bpy.types import Context, Header, STATUSBAR_HT_header

from .panels.sidebar import draw_job
from .worker_session import session

WIDTH = 16  # times the height of a button


def draw(header: Header, context: Context) -> None:
    """After what Blender draws."""
    if (job := session.slow_job()) is not None:
        row = header.layout.row()
        row.ui_units_x = WIDTH
        draw_job(row, job)


def register() -> None:
    """Add it."""
    STATUSBAR_HT_header.append(draw)


def unregister() -> None:
    """Remove it."""
    STATUSBAR_HT_header.remove(draw)
