# SPDX-License-Identifier: GPL-3.0-or-later
"""Take what Blender's own brushes did to the proxy into the field, as an entry of its history.

In a file that is older than layers the strokes so far become part of the base, for a replay would
change what was sculpted over. Muted ones are no part of the field and stay in the history.
"""

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Event, Operator

from ...scene.mesh import native_edits, proxy_mesh
from ...scene.properties import NETWORK, NEURAL_SCULPT_PG_field, field_of
from ...session import states
from ...session.absorption import live
from ...session.absorption.whole_proxy import LABEL, absorb_job
from ..job_operator import (
    FINISHED,
    REGISTER,
    Outcome,
    active_field,
    editable_poll,
    field_poll,
    launch,
    refuse,
)

QUESTION = n_("The field's {} strokes become part of its base and leave the history.")


def strokes_that_leave(group: NEURAL_SCULPT_PG_field) -> int:
    """How many strokes one more layer makes part of the base: in a file that is older than layers
    all that are not muted."""
    return sum(not item.muted for item in group.strokes) if states.is_whole(group) else 0


class NEURAL_SCULPT_OT_absorb(Operator):
    """Take what other brushes did to the proxy into the field and its history"""

    bl_idname = "neural_sculpt.absorb"
    bl_label = LABEL
    bl_options = REGISTER

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A proxy that was changed."""
        if not field_poll(cls, context):
            return False
        ob = active_field(context)
        if proxy_mesh.in_dyntopo(ob):
            return True
        if not editable_poll(cls, context):
            return False
        if field_of(ob).solver == NETWORK:
            return refuse(cls, "Absorbing adds detail. Choose Detail in the panel Model first")
        if ob.mode != "SCULPT" and not native_edits.edited(ob):
            return refuse(cls, "The proxy is as the field made it")
        return True

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask before strokes without layers leave the list."""
        count = strokes_that_leave(field_of(active_field(context)))
        if not count:
            return self.execute(context)
        return context.window_manager.invoke_confirm(
            self,
            event,
            title=iface_(LABEL),
            message=iface_(QUESTION).format(count),
            confirm_text=iface_(LABEL),
        )

    def execute(self, context: Context) -> Outcome:
        """Have the worker absorb the proxy, unless live absorption is about to do so."""
        ob = active_field(context)
        if live.let_come(ob):
            return FINISHED
        if proxy_mesh.in_dyntopo(ob):
            bpy.ops.sculpt.dynamic_topology_toggle()  # only then the mesh has what was sculpted
        return launch(self, absorb_job(ob))
