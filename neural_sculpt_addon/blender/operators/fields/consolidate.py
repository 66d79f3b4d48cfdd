# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a plain network of the active field: small, and what the authors' tool reads."""

from bpy.props import IntProperty
from bpy.types import Context, Event, Operator

from ....worker.client import JobKind, Message
from ...scene.commit import new_revision, set_base
from ...scene.mesh import native_edits
from ...scene.properties import field_of, found, shown_as
from ...session import states
from ...session.job import Job, Request
from ...session.worker_session import session
from ..job_operator import REGISTER, Outcome, active_field, editable_poll, launch, refuse

WIDEST = 512


class NEURAL_SCULPT_OT_consolidate(Operator):
    """Fit a network without detail to the field, which loses some of it. The strokes become part \
of the base"""

    bl_idname = "neural_sculpt.consolidate"
    bl_label = "Consolidate"
    bl_options = REGISTER

    width: IntProperty(
        name="Width",
        description="Units in each of the network's two layers: more hold more and take longer",
        default=256,
        min=32,
        max=WIDEST,
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field that nothing is about to change."""
        if not editable_poll(cls, context):
            return False
        if session.pending(active_field(context).session_uid):
            return refuse(cls, "The worker still changes this field")
        return True

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for the width."""
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: Context) -> Outcome:
        """Fit in the worker; what was lost is in the report."""
        target, label, width = active_field(context).session_uid, self.bl_label, self.width

        def request() -> Request:
            ob = found(target)
            return states.request(
                ob,
                width=width,
                **shown_as(field_of(ob)),
                result_revision=new_revision(),
            )

        def apply(result: Message) -> None:
            ob = found(target)
            native_edits.refuse(ob)
            base = result.arrays["field"].tobytes()
            set_base(ob, label, base, result.fields["id"], result)

        return launch(self, Job(JobKind.CONSOLIDATE, label, request, apply, target=target))
