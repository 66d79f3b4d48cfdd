# SPDX-License-Identifier: GPL-3.0-or-later
"""What the status bar says can be done now. Blender draws it again only when it is told so."""

# pyright: reportOptionalMemberAccess=false, reportAttributeAccessIssue=false

import bpy


class _State:
    hint: str | None = None


def show(hint: str | None) -> None:
    """Say it; None leaves the status bar to Blender."""
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
