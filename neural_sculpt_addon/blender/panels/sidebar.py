# SPDX-License-Identifier: GPL-3.0-or-later
"""What all panels of the sidebar share."""

from typing import Any

from bpy.types import Context, Panel, UILayout

from ..locale.translations import OURS, translated
from ..scene.properties import is_field
from ..session.job import Job
from ..session.worker_session import session

CLOSED_AT_FIRST: Any = {"DEFAULT_CLOSED"}
"""Options of a panel that is closed at first."""


class Sidebar(Panel):
    """A panel of our tab."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Neural Sculpt"
    bl_translation_context = OURS


class FieldSidebar(Sidebar):
    """A panel that is there while a field is active."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field."""
        return is_field(context.active_object)


def draw_job(layout: UILayout, job: Job) -> None:
    """How far a job is, and the button that cancels all."""
    text = job.title
    if job.message:
        text = f"{text}: {translated(job.message)}"
    row = layout.row(align=True)
    row.progress(factor=job.fraction, text=text, translate=False)
    row.operator("neural_sculpt.cancel", text="", icon="CANCEL")


def job_of(context: Context) -> Job | None:
    """The first job on the active object."""
    ob = context.active_object
    uid = None if ob is None else ob.session_uid
    return next((job for job in session.jobs if job.target == uid), None)
