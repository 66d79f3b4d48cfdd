# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt the strokes of a stroke file on the active field."""

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy.types import Context, Event, Operator

from ....common.errors import SculptError
from ....stroke.file import parse_strokes
from ...session.absorption import live
from ..job_operator import (
    REGISTER,
    Outcome,
    active_field,
    editable_poll,
    launch_strokes,
    reports_errors,
)

LARGEST_FILE = 64 * 2**20
"""Bytes of a stroke file at most: a thousand strokes with as many points as one can have."""


class NEURAL_SCULPT_OT_strokes_from_file(Operator):
    """Sculpt the strokes of a stroke file on the active neural field"""

    bl_idname = "neural_sculpt.strokes_from_file"
    bl_label = "Strokes from File"
    bl_options = REGISTER

    filepath: StringProperty(
        name="File",
        description="A stroke file (.json); its lengths are in model space",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field whose proxy can be replaced."""
        return editable_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for the file."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Read it and have the worker sculpt its strokes, as one step."""
        ob = active_field(context)
        live.refuse_edits(ob)
        path = Path(bpy.path.abspath(self.filepath))
        strokes = parse_strokes(_text(path))
        if not strokes:
            raise SculptError("The stroke file holds no strokes.")
        return launch_strokes(self, ob, strokes)


def _text(path: Path) -> str:
    """The text of a file. SculptError when it cannot be read or is too large."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise SculptError("{} is larger than any stroke file. Choose another one.", path.name)
        return content.decode("utf-8")
    except (OSError, ValueError) as error:
        raise SculptError(
            "{} cannot be read ({}). Choose another file.", path.name, error
        ) from error
