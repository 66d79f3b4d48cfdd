# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the field as it is its own base, from which later replays start.

The strokes then are no entries of the history any more, so the artist is asked first; a script is
not.
"""

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Event, Operator

from ....worker.client import JobKind, Message
from ...scene.commit import set_base
from ...scene.properties import field_of, found
from ...session import states
from ...session.job import Job, Request
from ...session.worker_session import session
from ..job_operator import FINISHED, REGISTER, Outcome, active_field, launch, refuse, reports_errors
from ..strokes.history import listed_poll

QUESTION = n_(
    "{} strokes become part of the base. They leave the history and can no longer be edited."
)
QUESTION_OF_ONE = n_(
    "1 stroke becomes part of the base. It leaves the history and can no longer be edited."
)


class NEURAL_SCULPT_OT_apply_to_base(Operator):
    """Take all strokes that are not muted into the base of the field and off the list"""

    bl_idname = "neural_sculpt.apply_to_base"
    bl_label = "Apply to Base"
    bl_options = REGISTER

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field with strokes that nothing is about to change."""
        if not listed_poll(cls, context):
            return False
        if any(job.target == active_field(context).session_uid for job in session.jobs):
            return refuse(cls, "The worker still changes this field")
        return True

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask before strokes leave the list."""
        count = sum(not item.muted for item in field_of(active_field(context)).strokes)
        if not count:
            return self.execute(context)
        return context.window_manager.invoke_confirm(
            self,
            event,
            title=iface_(self.bl_label),
            message=iface_(QUESTION_OF_ONE if count == 1 else QUESTION).format(count),
            confirm_text=iface_(self.bl_label),
        )

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Replace the base; the worker adds up base and layers."""
        ob = active_field(context)
        target, label, group = ob.session_uid, self.bl_label, field_of(ob)
        if states.is_whole(group):
            set_base(ob, label, group.weights, group.weights_id)
            return FINISHED

        def request() -> Request:
            return states.request(found(target))

        def apply(result: Message) -> None:
            base = result.arrays["field"].tobytes()
            set_base(found(target), label, base, result.fields["id"])

        return launch(self, Job(JobKind.APPLY_TO_BASE, label, request, apply, target=target))
