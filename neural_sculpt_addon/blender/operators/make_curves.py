# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the curves of the brush in a scene that has none: one where no field was ever added."""

from bpy.types import Context, Operator

from ..scene.commit import begin_change, push_undo
from ..scene.properties import brush_of, ensure_curves
from .launch import FINISHED, INTERNAL, Outcome, refuse


class NEURAL_SCULPT_OT_make_curves(Operator):
    """Show the curve, to shape it"""

    bl_idname = "neural_sculpt.make_curves"
    bl_label = "Show Curve"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Where an undo step holds the scene."""
        if context.mode in {"OBJECT", "SCULPT"}:
            return True
        return refuse(cls, "Leave Edit Mode first")

    def execute(self, context: Context) -> Outcome:
        """Make all of them, as an undo step of their own."""
        begin_change()
        ensure_curves(brush_of(context))
        push_undo(self.bl_label)
        return FINISHED
