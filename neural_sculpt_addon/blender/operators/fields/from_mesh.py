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
from numpy.typing import NDArray

from ....common.errors import SculptError
from ....common.text import Text
from ....worker.client import JobKind, Message
from ... import notice, preferences
from ...locale.translations import OURS
from ...scene.commit import NewField, create_field
from ...scene.mesh import proxy_mesh
from ...scene.mesh.dress import Dress
from ...scene.properties import LOCAL, find, solver_property
from ...scene.succession import has_maps, left_behind
from ...session import reports
from ...session.job import Job, Request
from ...session.worker_session import session
from ...viewport import fit_overlay
from ..job_operator import REGISTER, Outcome, refuse, reports_errors
from ..jobs.install_worker import launch_when_installed

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
        vertices, triangles, frame = read_source(source, context)
        dress = read_dress(source, context, vertices)
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
        arrays = {"vertices": vertices, "triangles": triangles}

        def add(result: Message) -> None:
            place_now = place(result)
            made_of = f"{name} (mesh)"
            new = NewField(f"{name} Field", made_of, scene, place_now, shown, solver, scale)
            report, replaced = result.fields["report"], find(uid)
            ob = create_field(new, result, report, replaced, dress.worn(result))
            if replaced is not None and replaced.parent is not None and ob.parent is None:
                notice.tell(
                    Text(
                        "The field of {} has no parent: the uneven scale of {} would distort it.",
                        name,
                        replaced.parent.name,
                    )
                )
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
        job.foresee = dress.foresee
        job.preview = lambda preview: fit_overlay.show(
            preview, place(preview), lambda: job in session.jobs
        )
        return launch_when_installed(self, context, job)


def read_source(
    source: Object, context: Context
) -> tuple[NDArray[np.float32], NDArray[np.int32], Matrix]:
    """Vertices (V, 3) and triangles (F, 3) of the evaluated mesh, and their frame in the world."""
    location, rotation, _ = source.matrix_world.decompose()
    frame = Matrix.Translation(location.to_tuple()) @ rotation.to_matrix().to_4x4()
    return *read_in(source, context, frame), frame


def kept_scale(source: Object) -> float:
    """The scale of an object in the world if it is the same along all axes and positive. Any other
    scale is applied to the shape, and this is 1."""
    scale = np.array(source.matrix_world.to_scale())
    even = scale.min() > 0 and scale.max() < (1 + EVEN) * scale.min()
    return float(scale.mean()) if even else 1.0


def read_dress(source: Object, context: Context, vertices: NDArray[np.float32]) -> Dress:
    """What hangs on the evaluated mesh, whose vertices (V, 3) `read_source` gave."""
    evaluated = source.evaluated_get(context.evaluated_depsgraph_get())
    turned = source.matrix_world.determinant() < 0
    try:
        return Dress.of(evaluated, evaluated.to_mesh(), vertices, turned)
    finally:
        evaluated.to_mesh_clear()


def read_in(
    source: Object, context: Context, frame: Matrix
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (F, 3) of the evaluated mesh in a frame of the world.

    SculptError when it has no faces.
    """
    shape = frame.inverted_safe() @ source.matrix_world
    evaluated = source.evaluated_get(context.evaluated_depsgraph_get())
    try:
        vertices, triangles = proxy_mesh.read(evaluated.to_mesh())
    finally:
        evaluated.to_mesh_clear()
    if not len(triangles):
        raise SculptError("{} has no faces. Choose a mesh with a closed surface.", source.name)
    linear, offset = np.array(shape.to_3x3()), np.array(shape.translation)  # (3, 3), (3,)
    if np.linalg.det(linear) < 0:
        triangles = triangles[:, ::-1]
    vertices = (vertices @ linear.T + offset).astype(np.float32)  # (V, 3)
    return vertices, np.ascontiguousarray(triangles)
