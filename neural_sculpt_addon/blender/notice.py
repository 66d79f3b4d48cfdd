# SPDX-License-Identifier: GPL-3.0-or-later
"""Notices: messages in the status bar of what happened in the background.

Blender shows there what an operator reports, but not while Python calls it: only while it handles
an event. So this operator waits for the next event, reports, and passes the event on. Of several
reports Blender shows the last alone, so what is told before that event is one report.
"""

from typing import TYPE_CHECKING

import bpy
from bpy.types import Context, Event, Operator

from .locale.translations import translated

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import OperatorReturnItems


_told: list[str] = []
"""Messages that are not shown yet."""


class NEURAL_SCULPT_OT_notice(Operator):
    """Show messages in the status bar"""

    bl_idname = "neural_sculpt.notice"
    bl_label = "Neural Sculpt"
    bl_options = {"INTERNAL"}  # noqa: RUF012 - Blender's own way

    def invoke(self, context: Context, event: Event) -> "set[OperatorReturnItems]":
        """Start a timer, whose event comes at once."""
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> "set[OperatorReturnItems]":
        """Report the messages, unless another one of this operator has."""
        context.window_manager.event_timer_remove(self._timer)
        if _told:
            self.report({"WARNING"}, " ".join(_told))
            _told.clear()
        return {"FINISHED", "PASS_THROUGH"}

    def cancel(self, context: Context) -> None:
        """Its window is closed, or another file is loaded, of which the messages say nothing."""
        _told.clear()


def tell(message: str) -> None:
    """Show a text in the artist's language in the first window; nothing without a window."""
    if bpy.app.background:
        return
    if (text := translated(message)) not in _told:
        _told.append(text)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.neural_sculpt.notice("INVOKE_DEFAULT")  # pyright: ignore[reportAttributeAccessIssue]
