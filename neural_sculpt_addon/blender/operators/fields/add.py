# SPDX-License-Identifier: GPL-3.0-or-later
"""Add a neural field at the 3D cursor: a ready-made one, or one from a file."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy.types import Context, Event, Operator
from mathutils import Matrix

from ....common.text import Text
from ....worker.client import JobKind, Message
from ... import preferences
from ...locale.translations import OURS
from ...scene.commit import NewField, create_field
from ...session.job import Job, Request
from ..job_operator import REGISTER, Outcome, fail
from ..jobs.install_worker import launch_when_installed

PRIMITIVES = ("SPHERE", "TORUS", "BOX", "CAPSULE", "SUZANNE")
"""The names in `field/primitives.py`, which Blender's process cannot import, in capitals."""

FILE = "FILE"


class NEURAL_SCULPT_OT_add(Operator):
    """Add a neural field at the 3D cursor"""

    bl_idname = "neural_sculpt.add"
    bl_label = "Add Neural Field"
    bl_options = REGISTER

    kind: EnumProperty(
        name="Kind",
        description="What the field is made of",
        items=[
            *((name, name.title(), f"A {name.lower()} as a neural field") for name in PRIMITIVES),
            (FILE, "From File…", "A network from a .safetensors or .pth file"),
        ],
        translation_context=OURS,
    )
    filepath: StringProperty(
        name="Network",
        description="A .safetensors or .pth file",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default="*.safetensors;*.pth", options={"HIDDEN"})

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Open the file browser for a field from a file."""
        if self.kind == FILE and not self.filepath:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return self.execute(context)

    def execute(self, context: Context) -> Outcome:
        """Have the worker load the field; its object is added when the worker has answered."""
        shown = preferences.new_proxy()
        scene = context.scene.session_uid
        matrix = Matrix.Translation(context.scene.cursor.location)
        if self.kind == FILE:
            path = Path(bpy.path.abspath(self.filepath))
            if not path.is_file():
                return fail(
                    self, Text("There is no file {}. Choose a .safetensors or .pth file.", path)
                )
            new = NewField(path.stem, path.name, scene, matrix, shown)
            fields = {"path": str(path), **shown.asked()}
            kind = JobKind.LOAD
        else:
            new = NewField(self.kind.title(), self.kind.title(), scene, matrix, shown)
            fields = {"primitive": self.kind.lower(), **shown.asked()}
            kind = JobKind.FIT

        def add(result: Message) -> None:
            create_field(new, result, result.fields.get("report", {}))

        job = Job(kind, Text("Add {}", new.name), lambda: Request(fields), add)
        return launch_when_installed(self, context, job)
