# SPDX-License-Identifier: GPL-3.0-or-later
"""Booleans: the active field united with, cut by or cut down to the other selected object.

The other object, a field or a mesh, stays and is hidden. The result is one entry of the history,
beside the strokes. While the dialog is open the viewport shows what it would be.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.props import EnumProperty, FloatProperty
from bpy.types import Context, Event, Object, Operator

from ....common.errors import SculptError
from ....worker.client import JobKind, Message
from ...locale.translations import OURS
from ...scene.commit import add_entry, new_revision
from ...scene.extent import refuse_flat
from ...scene.mesh import native_edits
from ...scene.properties import NETWORK, field_of, find, found, is_field, shown_as, world_scale
from ...scene.stroke_list import Entry
from ...session import states
from ...session.job import Job, Request
from ...session.worker_session import session
from ...viewport import fit_overlay
from ..job_operator import (
    REGISTER,
    Outcome,
    active_field,
    editable_poll,
    fail,
    launch,
    refuse,
)
from . import absorb, boolean_preview, source_mesh

OPERATIONS = (
    ("UNION", n_("Union"), n_("Both together")),
    ("DIFFERENCE", n_("Difference"), n_("The field without the other object")),
    ("INTERSECTION", n_("Intersection"), n_("What lies in both")),
)
ENTRIES = {
    "UNION": n_("Union with {}"),
    "DIFFERENCE": n_("Difference from {}"),
    "INTERSECTION": n_("Intersection with {}"),
}


class NEURAL_SCULPT_OT_boolean(Operator):
    """Unite the active field with the other selected field or mesh, or cut it by that"""

    bl_idname = "neural_sculpt.boolean"
    bl_label = "Neural Boolean"
    bl_options = REGISTER

    operation: EnumProperty(
        name="Operation", description="What is made of both", items=OPERATIONS, default="UNION"
    )
    blend: FloatProperty(
        name="Blend",
        translation_context=OURS,
        description="Radius in which both flow into each other; 0 leaves a crease",
        min=0.0,
        subtype="DISTANCE",
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        """An active field in Object Mode, and one more solid."""
        if not editable_poll(cls, context):
            return False
        if context.mode != "OBJECT":
            return refuse(cls, "Leave this mode for Object Mode first")
        if field_of(active_field(context)).solver == NETWORK:
            return refuse(cls, "Booleans add detail. Choose Detail in the panel Model first")
        if _other(context) is None:
            return refuse(cls, "Select another field or mesh, and the field last")
        return True

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for the operation and the blend radius."""
        self.check(context)
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: Context) -> None:
        """The settings, and whether strokes leave the history."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "operation")
        layout.prop(self, "blend")
        ob = context.active_object
        if is_field(ob) and (count := absorb.strokes_that_leave(field_of(ob))):
            told = iface_(absorb.QUESTION).format(count)
            layout.label(text=told, icon="INFO", translate=False)

    def check(self, context: Context) -> bool:
        """Preview the Boolean with the settings of the dialog; whether the dialog is to be drawn
        again."""
        if self.poll(context):
            ob, other = active_field(context), _other(context)
            assert other is not None
            target, source, settings = ob.session_uid, other.session_uid, self._settings(ob)
            boolean_preview.show(
                ob, (source, *settings.values()), lambda: _preview(target, source, **settings)
            )
        return True

    def cancel(self, context: Context) -> None:
        """End the preview."""
        boolean_preview.end(context.active_object)

    def execute(self, context: Context) -> Outcome:
        """Have the worker combine both as they lie now; the result is an entry of the history."""
        ob, other = active_field(context), _other(context)
        assert other is not None
        target, source = ob.session_uid, other.session_uid
        name = iface_(ENTRIES[self.operation]).format(other.name)
        label = self.bl_label
        settings = self._settings(ob)
        try:
            solid = _solid(ob, other)
        except SculptError as error:
            boolean_preview.end(ob)
            return fail(self, error)

        def request() -> Request:
            ob = found(target)
            shown = {**shown_as(field_of(ob)), "result_revision": new_revision()}
            return _request(ob, solid(), **settings, **shown)

        def apply(result: Message) -> None:
            ob, other = found(target), find(source)
            native_edits.refuse(ob)
            add_entry(ob, Entry("", name), result, label, replaced=other)
            if other is not None:
                source_mesh.tell_if_linked(other)

        job = Job(JobKind.BOOLEAN, label, request, apply, target=target)

        def is_wanted() -> bool:
            return job in session.jobs

        job.preview = lambda preview: fit_overlay.show(
            preview, found(target).matrix_world, is_wanted, on_top=True
        )
        outcome = launch(self, job)
        fit_overlay.keep(is_wanted)  # what the dialog has shown
        boolean_preview.end()
        return outcome

    def _settings(self, ob: Object) -> dict[str, Any]:
        """The settings as fields of a request; the blend radius in model units."""
        return {"operation": self.operation.lower(), "blend": self.blend / world_scale(ob)}


def _other(context: Context) -> Object | None:
    """The one other selected object that has a surface."""
    others = [ob for ob in context.selected_objects or () if ob != context.active_object]
    return others[0] if len(others) == 1 and others[0].type == "MESH" else None


def _preview(target: int, source: int, **fields: Any) -> Request:
    """The request for a preview of both objects, by their session_uid, as they are now."""
    ob = found(target)
    return _request(ob, _solid(ob, _found_other(source))(), **fields)


def _request(ob: Object, solid: Request, **fields: Any) -> Request:
    """The request for a field as it is now, and the other solid."""
    native_edits.refuse(ob)
    asked = states.request(ob, **fields)
    return replace(
        asked,
        fields={**asked.fields, **solid.fields},
        arrays=solid.arrays,
        held=asked.held | solid.held,
    )


def _solid(ob: Object, other: Object) -> Callable[[], Request]:
    """The other solid where it lies now: its part of the request, to be made when the job's turn
    comes.

    It is the state that a field has then, and the matrix from its model space to that of `ob`; or
    the triangles of a mesh as it is now, in the model space of `ob`. A field that other brushes or
    modifiers have changed counts as a mesh.

    SculptError when one of both is flat, or the mesh has no faces.
    """
    refuse_flat(ob)
    refuse_flat(other)
    is_modified = any(modifier.show_viewport for modifier in other.modifiers)
    if is_field(other) and not is_modified and not native_edits.edited(other):
        to_model = ob.matrix_world.inverted_safe() @ other.matrix_world
        matrix, source = np.array(to_model).ravel().tolist(), other.session_uid

        def known() -> Request:
            state = states.request(_found_other(source))
            return replace(state, fields={"other": state.fields, "matrix": matrix})

        return known
    vertices, triangles = source_mesh.read(other, ob.matrix_world)
    return lambda: Request({}, {"vertices": vertices, "triangles": triangles})


def _found_other(source: int) -> Object:
    if (other := find(source)) is None:
        raise SculptError("The other object of the Boolean is gone. Select one again.")
    return other
