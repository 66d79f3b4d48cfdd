# SPDX-License-Identifier: GPL-3.0-or-later
"""Choose what the strokes of the active field change: its detail, or the weights of its network."""

from bpy.types import Context, Operator

from ...scene.commit import set_solver
from ...scene.field_header import header_of
from ...scene.properties import NETWORK, field_of, solver_property
from ...session.absorption import live
from ...session.worker_session import session
from ..job_operator import FINISHED, REGISTER, Outcome, active_field, editable_poll, fail, refuse


class NEURAL_SCULPT_OT_choose_solver(Operator):
    """Choose what strokes change: detail, which keeps them where they are, or the network"""

    bl_idname = "neural_sculpt.choose_solver"
    bl_label = "Sculpt Detail or Network"
    bl_options = REGISTER

    solver: solver_property()

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field without strokes: with them, the other solver would give another field. None is on
        its way either."""
        if not editable_poll(cls, context):
            return False
        ob = active_field(context)
        if len(field_of(ob).strokes):
            return refuse(cls, "Apply the strokes to the base first, and delete muted ones")
        if session.pending(ob.session_uid) or live.is_on_its_way(ob):
            return refuse(cls, "The worker still changes this field")
        return True

    def execute(self, context: Context) -> Outcome:
        """Choose it for the strokes to come."""
        ob = active_field(context)
        if self.solver == NETWORK and header_of(ob).detail:
            return fail(
                self, "This field has detail, which a network cannot hold. Consolidate it first."
            )
        if self.solver != field_of(ob).solver:
            set_solver(ob, self.solver, self.bl_label)
        return FINISHED
