# SPDX-License-Identifier: GPL-3.0-or-later
"""Change the list of strokes: mute, solo, weaken, delete, duplicate, move.

Each operator takes the uid of a stroke, or works on the one that is chosen in the list.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar

from bpy.props import EnumProperty, StringProperty
from bpy.types import Context, Object, Operator

from ...scene import stroke_list
from ...scene.properties import field_of, strength_property
from ...scene.stroke_list import Entry
from ...session.replay import change_history
from ..job_operator import (
    FINISHED,
    REGISTER,
    Outcome,
    active_field,
    editable_poll,
    launch,
    refuse,
    reports_errors,
)

Change = Callable[..., Sequence[Entry]]
"""A function of `stroke_list` that takes the list and what is given, and returns the new list."""


def listed_poll(cls: type[Operator], context: Context) -> bool:
    """Whether the active object is a field that can be changed and has strokes."""
    if not editable_poll(cls, context):
        return False
    if not len(field_of(active_field(context)).strokes):
        return refuse(cls, "This field has no strokes yet")
    return True


def launch_change(operator: Operator, ob: Object, change: Change, **given: Any) -> Outcome:
    """Change the history of a field: `change` takes the list and what is given.

    SculptError when it cannot be changed so.
    """
    job = change_history(ob, operator.bl_label, partial(change, **given))
    return FINISHED if job is None else launch(operator, job)


def uid_property() -> Any:
    """The stroke that an operator works on."""
    return StringProperty(
        name="Stroke",
        description="Identity of the stroke, empty for the one chosen in the list",
        options={"HIDDEN", "SKIP_SAVE"},
    )


def chosen_uid(operator: Any, context: Context) -> str:
    """The uid of the stroke that the operator was given, or else of the one chosen in the list."""
    return operator.uid or stroke_list.active_uid(active_field(context))


class _ListOperator(Operator):
    bl_options = REGISTER
    change: ClassVar[Change]

    uid: uid_property()

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field with strokes."""
        return listed_poll(cls, context)

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Change the list and have the worker make the field of it."""
        ob, uid = active_field(context), chosen_uid(self, context)
        return launch_change(self, ob, self.change, uid=uid, **self._given())

    def _given(self) -> dict[str, Any]:
        """Further arguments of `change`, after the list and the uid."""
        return {}


class NEURAL_SCULPT_OT_mute_stroke(_ListOperator):
    """Leave the stroke out of the field, or take it in again"""

    bl_idname = "neural_sculpt.mute_stroke"
    bl_label = "Mute Stroke"
    change = staticmethod(stroke_list.muted)


class NEURAL_SCULPT_OT_solo_stroke(_ListOperator):
    """Leave all other strokes out of the field, or take all in again"""

    bl_idname = "neural_sculpt.solo_stroke"
    bl_label = "Solo Stroke"
    change = staticmethod(stroke_list.soloed)


class NEURAL_SCULPT_OT_set_strength(_ListOperator):
    """Change how much of the stroke is in the field"""

    bl_idname = "neural_sculpt.set_strength"
    bl_label = "Stroke Strength"
    change = staticmethod(stroke_list.weakened)

    strength: strength_property()

    def _given(self) -> dict[str, Any]:
        return {"strength": self.strength}


class NEURAL_SCULPT_OT_delete_stroke(_ListOperator):
    """Remove the stroke from the field and from the list"""

    bl_idname = "neural_sculpt.delete_stroke"
    bl_label = "Delete Stroke"
    change = staticmethod(stroke_list.deleted)


class NEURAL_SCULPT_OT_duplicate_stroke(_ListOperator):
    """Apply the stroke once more, right after itself"""

    bl_idname = "neural_sculpt.duplicate_stroke"
    bl_label = "Duplicate Stroke"
    change = staticmethod(stroke_list.duplicated)


class NEURAL_SCULPT_OT_move_stroke(_ListOperator):
    """Apply the stroke earlier or later than its neighbor"""

    bl_idname = "neural_sculpt.move_stroke"
    bl_label = "Move Stroke"
    change = staticmethod(stroke_list.moved)

    direction: EnumProperty(
        name="Direction",
        description="Where to",
        items=[
            ("UP", "Up", "One stroke earlier"),
            ("DOWN", "Down", "One stroke later"),
        ],
    )

    def _given(self) -> dict[str, Any]:
        return {"step": -1 if self.direction == "UP" else 1}
