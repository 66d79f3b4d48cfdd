# SPDX-License-Identifier: GPL-3.0-or-later
"""Install the worker, with the artist's consent and Blender's permission to go online."""

# pyright: reportOptionalMemberAccess=false

import bpy
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Event, Operator

from ...worker.install.installer import installer
from ..folders import environment_folder, installation_log
from ..viewport import redraw
from .launch import FINISHED, INTERNAL, Outcome, fail, refuse

TICK = 0.25  # seconds between two looks at the progress
EXPLANATION = (
    n_("Neural Sculpt computes in a separate process with PyTorch."),
    n_("Its packages are downloaded from the Python Package Index: about 300 MB,"),
    n_("1.5 GB on disk, in a folder of their own:"),
)


class NEURAL_SCULPT_OT_install_worker(Operator):
    """Download PyTorch into a folder of its own; nothing of Blender's is changed"""

    bl_idname = "neural_sculpt.install_worker"
    bl_label = "Install Worker"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Online access is allowed and no installation is under way."""
        if installer.running:
            return refuse(cls, "The worker is being installed")
        if not bpy.app.online_access:
            return refuse(cls, "Turn on Allow Online Access in Preferences, System first")
        return True

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Say what will happen and ask."""
        return context.window_manager.invoke_props_dialog(self, width=500, confirm_text="Install")

    def draw(self, context: Context) -> None:
        """What will happen."""
        column = self.layout.column(align=True)
        for line in EXPLANATION:
            column.label(text=line)
        column.label(text=str(environment_folder()), translate=False)

    def execute(self, context: Context) -> Outcome:
        """Begin."""
        if not bpy.app.online_access:
            return fail(self, "Turn on Allow Online Access in Preferences, System first.")
        installer.start(environment_folder(), installation_log())
        bpy.app.timers.register(show_progress, persistent=True)
        return FINISHED


class NEURAL_SCULPT_OT_cancel_installation(Operator):
    """Stop the installation of the worker"""

    bl_idname = "neural_sculpt.cancel_installation"
    bl_label = "Cancel Installation"
    bl_options = INTERNAL

    def execute(self, context: Context) -> Outcome:
        """End it."""
        installer.stop()
        return FINISHED


def stop() -> None:
    """Leave no timer and no growing environment behind."""
    installer.stop()
    if bpy.app.timers.is_registered(show_progress):
        bpy.app.timers.unregister(show_progress)


def show_progress() -> float | None:
    going_on = installer.poll()
    redraw.tag_panels()
    return TICK if going_on else None
