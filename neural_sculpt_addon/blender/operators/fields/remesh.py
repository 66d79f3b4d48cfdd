# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh the proxy of the active field again, finer or coarser. The field itself stays."""

from bpy.types import Context, Event, Operator

from ....worker.client import JobKind, Message
from ...panels import estimate
from ...scene.commit import set_proxy
from ...scene.mesh import native_edits
from ...scene.properties import field_of, found
from ...scene.proxy_properties import (
    ShownAs,
    most_triangles_property,
    refine_property,
    resolution_property,
    smooth_property,
)
from ...session import states
from ...session.absorption import live
from ...session.job import Job, Request
from ..job_operator import REGISTER, Outcome, active_field, editable_poll, launch


class NEURAL_SCULPT_OT_remesh(Operator):
    """Mesh the proxy of the active neural field again, finer or coarser, smooth or flat"""

    bl_idname = "neural_sculpt.remesh"
    bl_label = "Remesh Proxy"
    bl_options = REGISTER

    resolution: resolution_property("Cells along an edge of the field's box")
    refine: refine_property()
    most_triangles: most_triangles_property()
    smooth: smooth_property()

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field whose proxy can be replaced."""
        return editable_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask how fine it shall be, and say what that costs."""
        group = field_of(active_field(context))
        self.resolution, self.smooth = group.resolution, group.smooth
        self.refine, self.most_triangles = group.refine, group.most_triangles
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: Context) -> None:
        """Draw the resolution and its cost."""
        self.layout.prop(self, "resolution")
        estimate.draw_refinement(self.layout, self)  # pyright: ignore[reportArgumentType]
        self.layout.prop(self, "smooth")
        ob = active_field(context)
        most = self.most_triangles if self.refine else 0
        estimate.draw(self.layout, ob, self.resolution, most)  # pyright: ignore[reportArgumentType]
        if native_edits.edited(ob) and not live.is_on_its_way(ob):
            self.layout.label(text="What other brushes sculpted will be gone", icon="ERROR")

    def execute(self, context: Context) -> Outcome:
        """Have the worker mesh the field."""
        ob = active_field(context)
        target = ob.session_uid
        shown = ShownAs(self.resolution, self.refine, self.most_triangles, self.smooth)
        dropped = native_edits.mark(ob) if native_edits.edited(ob) else None

        def request() -> Request:
            return states.request(found(target), **shown.asked())

        def apply(result: Message) -> None:
            ob = found(target)
            if native_edits.edited(ob):
                native_edits.refuse_since(ob, dropped)
            set_proxy(ob, shown, result)

        return launch(self, Job(JobKind.MESH, "Remesh Proxy", request, apply, target=target))
