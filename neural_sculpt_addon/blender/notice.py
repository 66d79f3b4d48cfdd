# SPDX-License-Identifier: GPL-3.0-or-later
"""Notices: a message in the status bar of something that happened in the background.

Blender shows reports of operators only, and of an operator that Python calls only while it handles
an event. So this one waits for an event, reports, and passes the event on.
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
        """See to it that there is an event."""
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> "set[OperatorReturnItems]":
        """Tell."""
        context.window_manager.event_timer_remove(self._timer)
        self.report({"WARNING"}, self.message)
        return {"FINISHED", "PASS_THROUGH"}


def tell(message: str) -> None:
    """Show a text in the artist's language in the first window; there is none in the background."""
    if bpy.app.background:
        return
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.neural_sculpt.notice("INVOKE_DEFAULT", message=translated(message))  # pyright: ignore[reportAttributeAccessIssue]
