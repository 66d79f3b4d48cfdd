# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker does, and what went wrong last."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context

from ...worker.client import WorkerState
from ..layouts import draw_installation, draw_text
from ..locale.translations import translated
from ..session import worker_choice
from ..session.worker_session import session
from .sidebar import Sidebar, draw_job

STATES = {
    WorkerState.STOPPED: n_("Not started"),
    WorkerState.STARTING: n_("Starting"),
    WorkerState.HANGING: n_("Not responding"),
    WorkerState.DEAD: n_("Stopped unexpectedly"),
}

HANGING = n_(
    "The worker gives no sign of life. Restart it: no stroke is lost, the one that it was at is"
    " computed again."
)


class NEURAL_SCULPT_PT_worker(Sidebar):
    """What the worker does, and what went wrong last."""

    bl_idname = "NEURAL_SCULPT_PT_worker"
    bl_label = "Worker"

    def draw(self, context: Context) -> None:
        """Draw the worker's state, progress and last error."""
        layout = self.layout
        if not worker_choice.has_worker():
            draw_installation(layout, context)  # pyright: ignore[reportArgumentType]
            return
        row = layout.row(align=True)
        row.label(text=state(), icon="SYSTEM", translate=False)
        row.operator("neural_sculpt.open_log", text="", icon="TEXT")
        row.operator("neural_sculpt.restart_worker", text="", icon="FILE_REFRESH")
        row.operator("neural_sculpt.stop_worker", text="", icon="QUIT")
        if session.hangs:
            box = layout.column()
            box.alert = True
            draw_text(box, context, iface_(HANGING), "ERROR")
            layout.operator("neural_sculpt.restart_worker", text="Restart", icon="FILE_REFRESH")
        if session.jobs:
            draw_job(layout, session.jobs[0])  # pyright: ignore[reportArgumentType]
            if waiting := len(session.jobs) - 1:
                layout.label(text=iface_("{} waiting").format(waiting), translate=False)
        if session.last_error:
            box = layout.column()
            box.alert = True
            draw_text(box, context, translated(session.last_error), "ERROR")


def state() -> str:
    """What the worker is doing, and on what device."""
    client = session.client
    if client is None:
        return iface_(STATES[WorkerState.STOPPED])
    if client.hello is None or client.state is WorkerState.HANGING:
        return iface_(STATES[client.state])
    device = client.hello["device"]
    return iface_("Ready on {}").format(device.upper()) if device else iface_("No such device")
