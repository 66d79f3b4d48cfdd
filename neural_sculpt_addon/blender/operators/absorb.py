# SPDX-License-Identifier: GPL-3.0-or-later
"""Take what Blender's own brushes did to the proxy into the field.

The strokes so far become part of the base, since they cannot be replayed to what was sculpted over
them. Muted ones are no part of the field and stay in the history.
"""

# pyright: reportOptionalMemberAccess=false

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Event, Mesh, Operator

from ...stroke.errors import SculptError
from ...worker.client import JobKind, Message
from .. import native_edits, proxy_mesh, stroke_list
from ..commit import new_revision, set_history
from ..job import Job, Request, found
from ..properties import field_of
from .launch import REGISTER, Outcome, active_field, editable_poll, field_poll, launch, refuse

LABEL = n_("Absorb")
QUESTION = n_("The field's {} strokes become part of its base and leave the history.")


class NEURAL_SCULPT_OT_absorb(Operator):
    """Fit the field to its proxy as it was sculpted by other brushes. The strokes so far become \
part of its base"""

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
        if ob.mode != "SCULPT" and not native_edits.edited(ob):
            return refuse(cls, "The proxy is as the field made it")
        return True

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask before the strokes leave the list."""
        count = sum(not item.muted for item in field_of(active_field(context)).strokes)
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
        """Fit in the worker."""
        ob = active_field(context)
        if proxy_mesh.in_dyntopo(ob):
            bpy.ops.sculpt.dynamic_topology_toggle()  # only then the mesh has what was sculpted
        target = ob.session_uid
        absorbed: list[int] = []

        def request() -> Request:
            ob = found(target)
            if not native_edits.edited(ob):
                raise SculptError("The proxy is as the field made it; there is nothing to absorb.")
            group = field_of(ob)
            fields = {"resolution": group.resolution, "result_revision": new_revision()}
            assert isinstance(ob.data, Mesh)
            absorbed.append(native_edits.mark(ob))
            vertices, triangles = proxy_mesh.read(ob.data)
            arrays = {"vertices": vertices, "triangles": triangles}
            return fields, {"field": np.frombuffer(group.weights, np.uint8), **arrays}

        def apply(result: Message) -> None:
            ob = found(target)
            native_edits.refuse_since(ob, absorbed[-1])
            muted = [entry for entry in stroke_list.readable(ob) if entry.muted]
            set_history(ob, muted, LABEL, result, as_base=True)

        return launch(self, Job(JobKind.ABSORB, LABEL, request, apply, target=target))
