# SPDX-License-Identifier: GPL-3.0-or-later
"""Install the worker, with the artist's consent and Blender's permission to go online.

The first field asks for it, too: it is added when the worker is there.
"""

from collections.abc import Sequence

import bpy
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Event, Operator

from ....common.errors import SculptError
from ....worker.install.installer import installer
from ... import redraw
from ...folders import environment_folder, installation_log
from ...notice import tell
from ...session import worker_choice
from ...session.job import Job
from ...session.worker_session import session
from ..job_operator import CANCELLED, FINISHED, INTERNAL, Outcome, fail, launch, refuse

TICK = 0.25  # seconds between two looks at the progress
EXPLANATION = (
    n_("Neural Sculpt computes in a separate process with PyTorch."),
    n_("Its packages are downloaded from the Python Package Index: about 300 MB,"),
    n_("1.5 GB on disk, in a folder of their own:"),
)
OFFLINE = n_("Turn on Allow Online Access in Preferences, System first.")

_asked: list[Job] = []  # for which the dialog is about to open
_waiting: list[tuple[Job, int]] = []  # to be done after the installation, each in its scene


class NEURAL_SCULPT_OT_install_worker(Operator):
    """Download PyTorch into a folder of its own; nothing of Blender's is changed"""

    bl_idname = "neural_sculpt.install_worker"
    bl_label = "Install Worker"
    bl_options = INTERNAL

    _jobs: Sequence[Job] = ()
    _offline = False
    """Whether the dialog has the switch; it keeps it when that is on, so that nothing moves."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        """No installation is under way."""
        if installer.running:
            return refuse(cls, "The worker is being installed")
        return True

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Say what will happen and ask."""
        self._jobs, self._offline = [*_asked], not bpy.app.online_access
        _asked.clear()
        return context.window_manager.invoke_props_dialog(self, width=500, confirm_text="Install")

    def draw(self, context: Context) -> None:
        """What will happen, and Blender's own switch where that is off."""
        column = self.layout.column(align=True)
        for line in EXPLANATION:
            column.label(text=line)
        column.label(text=str(environment_folder()), translate=False)
        if self._offline:
            self.layout.prop(context.preferences.system, "use_online_access")

    def execute(self, context: Context) -> Outcome:
        """Begin."""
        if not bpy.app.online_access:
            return fail(self, OFFLINE)
        _wait_with(context, self._jobs)
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


def launch_when_installed(operator: Operator, context: Context, job: Job) -> Outcome:
    """Start a job that makes a new field. Without a worker ask for its installation first, by a
    dialog: in the background there is none, and the job fails."""
    if bpy.app.background or not worker_choice.lacks_worker():
        return launch(operator, job)
    if installer.running:
        _wait_with(context, [job])
        return FINISHED
    _asked[:] = [job]
    bpy.ops.neural_sculpt.install_worker("INVOKE_DEFAULT")  # pyright: ignore[reportAttributeAccessIssue]
    return CANCELLED


def stop() -> None:
    """Leave no timer and no growing environment behind."""
    _waiting.clear()
    installer.stop()
    if bpy.app.timers.is_registered(show_progress):
        bpy.app.timers.unregister(show_progress)


def show_progress() -> float | None:
    going_on = installer.poll()
    redraw.tag_panels()
    if going_on:
        return TICK
    _go_on()
    return None


def _wait_with(context: Context, jobs: Sequence[Job]) -> None:
    _waiting.extend((job, context.scene.session_uid) for job in jobs)


def _go_on() -> None:
    """Start what waited for the installation, unless that failed or another file was opened."""
    scenes = {scene.session_uid for scene in bpy.data.scenes}
    jobs = [job for job, scene in _waiting if scene in scenes and not installer.error]
    _waiting.clear()
    for job in jobs:
        try:
            session.run(job)
        except SculptError as error:
            tell(error.text)
