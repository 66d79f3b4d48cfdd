# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the active field: its network through the worker, its proxy through Blender."""

# pyright: reportInvalidTypeForm=false, reportOptionalMemberAccess=false

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, StringProperty
from bpy.types import Context, Event, Object, Operator

from ...worker.client import JobKind
from ..properties import field_of
from ..worker_session import Job
from .launch import FINISHED, REGISTER, Outcome, active_field, fail, field_poll, launch

NETWORKS = (".safetensors", ".pth")
MESHES = {".obj": "obj_export", ".ply": "ply_export", ".stl": "stl_export"}
"""Blender's own exporters."""


class NEURAL_SCULPT_OT_export(Operator):
    """Export the active neural field as a network or as a mesh"""

    bl_idname = "neural_sculpt.export"
    bl_label = "Export Neural Field"
    bl_options = REGISTER

    filepath: StringProperty(
        name="File",
        description="Network: .safetensors or .pth. Proxy mesh: .obj, .ply or .stl",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(
        default=";".join(f"*{suffix}" for suffix in (*NETWORKS, *MESHES)), options={"HIDDEN"}
    )
    check_existing: BoolProperty(default=True, options={"HIDDEN"})

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field."""
        return field_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for the file."""
        if not self.filepath:
            self.filepath = bpy.path.clean_name(active_field(context).name) + NETWORKS[0]
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Context) -> Outcome:
        """Write the file; its suffix says what it is."""
        ob = active_field(context)
        path = Path(bpy.path.abspath(self.filepath))
        suffix = path.suffix.lower()
        if not path.parent.is_dir():
            return fail(self, f"There is no folder {path.parent}. Choose another place.")
        if suffix in NETWORKS:
            weights = np.frombuffer(field_of(ob).weights, np.uint8)
            request = {"path": str(path)}, {"field": weights}
            return launch(
                self, Job(JobKind.SAVE, f"Export {path.name}", lambda: request, lambda _: None)
            )
        if suffix not in MESHES:
            known = ", ".join((*NETWORKS, *MESHES))
            return fail(self, f"A field cannot be exported as {path.name}. Use one of {known}.")
        return self._export_mesh(context, ob, path)

    def _export_mesh(self, context: Context, ob: Object, path: Path) -> Outcome:
        export = getattr(bpy.ops.wm, MESHES[path.suffix.lower()])
        try:
            with _selected_alone(context, ob):
                export(filepath=str(path), export_selected_objects=True)
        except RuntimeError as error:  # an operator's error report
            cause = str(error).strip().removeprefix("Error: ")
            return fail(
                self, f"{path.name} was not written ({cause}). Choose another folder or file name."
            )
        return FINISHED


@contextmanager
def _selected_alone(context: Context, ob: Object) -> Iterator[None]:
    """Blender's exporters take what is selected."""
    selected = [*(context.selected_objects or ())]
    for other in selected:
        other.select_set(False)
    ob.select_set(True)
    try:
        yield
    finally:
        ob.select_set(False)
        for other in selected:
            other.select_set(True)
