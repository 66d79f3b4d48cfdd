# SPDX-License-Identifier: GPL-3.0-or-later
"""Notices: messages in the status bar of what happened in the background.

Blender shows there what an operator reports, but not while Python calls it: only while it handles
an event. So this operator waits for the next event, reports, and passes the event on.
"""

from typing import TYPE_CHECKING

import bpy
from bpy.props import StringProperty
from bpy.types import Context, Event, Operator

from .locale.translations import translated

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import OperatorReturnItems


class NEURAL_SCULPT_OT_notice(Operator):
    """Show a message in the status bar"""

    bl_idname = "neural_sculpt.notice"
    bl_label = "Neural Sculpt"
    bl_options = {"INTERNAL"}  # noqa: RUF012 - Blender's own way

    message: StringProperty(options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: Context, event: Event) -> "set[OperatorReturnItems]":
        """Start a timer, whose event comes at once."""
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> "set[OperatorReturnItems]":
        """Report the message."""
        context.window_manager.event_timer_remove(self._timer)
        self.report({"WARNING"}, self.message)
        return {"FINISHED", "PASS_THROUGH"}


def tell(message: str) -> None:
    """Show a text in the artist's language in the first window; nothing without a window."""
    if bpy.app.background:
        return
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.neural_sculpt.notice("INVOKE_DEFAULT", message=translated(message))  # pyright: ignore[reportAttributeAccessIssue]
