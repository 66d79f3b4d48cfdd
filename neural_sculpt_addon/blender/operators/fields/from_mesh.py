# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit a neural field to the active mesh, as its modifiers show it.

The fit works in coordinates that differ from the world only by the object's place and rotation, so
the new object is never sheared or unevenly scaled and a round brush is round in the scene. A scale
that is the same along all axes stays the object's own.
"""

import numpy as np
from bpy.props import EnumProperty, FloatProperty, IntProperty
from bpy.types import Context, Event, Object, Operator
from mathutils import Matrix

from ....common.text import Text
from ....worker.client import JobKind, Message
from ... import notice, preferences
from ...locale.translations import OURS
from ...scene.commit import NewField, create_field
from ...scene.mesh import proxy_mesh
from ...scene.properties import LOCAL, find, solver_property
from ...scene.succession import has_maps, left_behind
from ...session import reports
from ...session.job import Job, Request
from ...session.worker_session import session
from ...viewport import fit_overlay
from ..job_operator import REGISTER, Outcome, refuse, reports_errors
from ..jobs.install_worker import launch_when_installed
from . import source_mesh

PROPOSED = 0.02
"""Thickness of open parts, as a share of the longest side."""

EVEN = 1e-4
"""Relative difference of the scales along two axes up to which they count as equal."""


class NEURAL_SCULPT_OT_from_mesh(Operator):
    """Fit a neural field to the active mesh"""

    bl_idname = "neural_sculpt.from_mesh"
    bl_label = "Neural Field from Mesh"
    bl_options = REGISTER

    preset: EnumProperty(
        name="Quality",
        description="How close to the mesh, and how long it takes",
        items=[
            ("DRAFT", "Draft", "Quick and rough"),
            ("NORMAL", "Normal", "Good enough to sculpt on"),
            ("FINE", "Fine", "Slow and close to the mesh"),
        ],
        default="NORMAL",
        translation_context=OURS,
    )
    solver: solver_property()
    width: EnumProperty(
        name="Width",
        description="Units in each of the network's two layers: more hold more and take longer",
        items=[
            ("64", "64", "Small and fast, for simple shapes"),
            ("128", "128", "As large as those of the paper"),
            ("256", "256", "Large and slow"),
        ],
        default="128",
    )
    open_parts: EnumProperty(
        name="Open Parts",
        description="What becomes of parts of the mesh that have openings",
        items=[
            ("SOLID", "Solid", "Openings are closed by a film"),
            ("THICKNESS", "Thickness", "Open parts become shells"),
        ],
        default="SOLID",
        translation_context=OURS,
    )
    thickness: FloatProperty(
        name="Thickness",
        description="Of open parts; 0 chooses 2 % of the longest side",
        min=0.0,
        subtype="DISTANCE",
    )
    seed: IntProperty(name="Seed", description="Of all random numbers", min=0)

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A mesh outside of Edit Mode. Multires and Dyntopo write it when Sculpt Mode ends."""
        ob = context.active_object
        if ob is None or ob.type != "MESH":
            return refuse(cls, "Select a mesh object first")
        if ob.mode == "EDIT":
            return refuse(cls, "Leave Edit Mode first")
        multires = ob.mode == "SCULPT" and proxy_mesh.has_multires(ob)
        if multires or proxy_mesh.in_dyntopo(ob):
            return refuse(
                cls, "Leave Sculpt Mode first, for Multires and Dyntopo to end their work"
            )
        return True

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for quality, size and what open parts become, and propose a thickness for these."""
        if not self.properties.is_property_set("thickness") and context.active_object:
            self.thickness = PROPOSED * max(context.active_object.dimensions[:])
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: Context) -> None:
        """Thickness only where it counts."""
        layout = self.layout
        layout.use_property_split = True
        for name in ("preset", "solver", "width", "open_parts"):
            layout.prop(self, name)
        row = layout.row()
        row.active = self.open_parts == "THICKNESS"
        row.prop(self, "thickness")
        layout.prop(self, "seed")
        source = context.active_object
        if source is None or source.type != "MESH":
            return
        column = layout.column(align=True)
        if left := left_behind(source):
            column.label(text="Stays with the mesh, which is hidden:", icon="INFO")
            column.label(text=left, icon="BLANK1", translate=False)
        if has_maps(source):
            column.label(text="UV maps are approximate along their seams", icon="INFO")

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Fit in the worker; the object appears when it is there."""
        source = context.active_object
        assert source is not None
        frame = frame_of(source)
        mesh = source_mesh.read_dressed(source, frame)
        shown = preferences.new_proxy()
        scene = context.scene.session_uid
        name, uid, solver, scale = source.name, source.session_uid, self.solver, kept_scale(source)

        def place(message: Message) -> Matrix:
            shift = Matrix.Translation(message.fields["center"])
            return frame @ shift @ Matrix.Scale(message.fields["scale"], 4)

        fields = {
            "preset": self.preset.lower(),
            "detail": self.solver == LOCAL,
            "width": int(self.width),
            "open": self.open_parts.lower(),
            "thickness": (self.thickness or None) if self.open_parts == "THICKNESS" else None,
            "seed": self.seed,
            "keep_origin": True,
            **shown.asked(),
        }
        arrays = {"vertices": mesh.vertices, "triangles": mesh.triangles}

        def add(result: Message) -> None:
            place_now = place(result)
            made_of = f"{name} (mesh)"
            new = NewField(
                f"{name} Field", made_of, scene, place_now, shown, solver, scale, mesh.materials
            )
            report, replaced = result.fields["report"], find(uid)
            ob = create_field(new, result, report, replaced, mesh.dress.worn(result))
            if replaced is not None:
                _tell_of(ob, replaced)
            axes = [axis for axis, x in zip("XYZ", result.fields["center"], strict=True) if x]
            if axes:
                notice.tell(
                    Text(
                        "The origin of {} is far from its middle. Along {} the field's own, and"
                        " with it the plane of symmetry, is the middle.",
                        name,
                        ", ".join(axes),
                    )
                )
            for note in reports.notes_of(report):
                notice.tell(note)

        job = Job(JobKind.FIT, Text("Fit {}", name), lambda: Request(fields, arrays), add)
        job.foresee = mesh.dress.foresee
        job.preview = lambda preview: fit_overlay.show(
            preview, place(preview), lambda: job in session.jobs
        )
        return launch_when_installed(self, context, job)


def _tell_of(ob: Object, replaced: Object) -> None:
    """Tell what a field could not take over from the mesh whose place it takes."""
    source_mesh.tell_if_linked(replaced)
    if replaced.parent is not None and ob.parent is None:
        notice.tell(
            Text(
                "The field of {} has no parent: the uneven scale of {} would distort it.",
                replaced.name,
                replaced.parent.name,
            )
        )


def frame_of(source: Object) -> Matrix:
    """The place and the rotation of an object in the world."""
    location, rotation, _ = source.matrix_world.decompose()
    return Matrix.Translation(location.to_tuple()) @ rotation.to_matrix().to_4x4()


def kept_scale(source: Object) -> float:
    """The scale of an object in the world, without its delta scale, if it is the same along all
    axes and positive. Any other scale is applied to the shape, and this is 1."""
    scale, delta = np.array(source.matrix_world.to_scale()), np.array(source.delta_scale)
    scale = np.divide(scale, delta, out=scale, where=delta != 0)
    even = scale.min() > 0 and scale.max() < (1 + EVEN) * scale.min()
    return float(scale.mean()) if even else 1.0
