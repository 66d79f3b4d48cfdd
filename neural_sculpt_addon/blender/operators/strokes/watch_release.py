# SPDX-License-Identifier: GPL-3.0-or-later
"""Release of the mouse button that drags the slider of `strength`.

Blender does not tell Python of it, but a modal operator that runs beside the slider sees the event.
"""

from bpy.types import Context, Event, Operator

from ...panels import strength
from ..job_operator import INTERNAL, Outcome


class NEURAL_SCULPT_OT_watch_release(Operator):
    """Wait for the end of a drag"""

    bl_idname = "neural_sculpt.watch_release"
    bl_label = "Watch Release"
    bl_options = INTERNAL

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Begin to watch."""
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> Outcome:
        """Watch, and leave every event to others."""
        if not strength.is_dragged():
            return {"FINISHED", "PASS_THROUGH"}
        if event.type == "LEFTMOUSE" and event.value in {"PRESS", "RELEASE"}:
            strength.release()
            return {"FINISHED", "PASS_THROUGH"}
        return {"PASS_THROUGH"}
