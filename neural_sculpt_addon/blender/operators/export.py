# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the active field: its network, a mesh of any resolution, or a level set.

Worker and field make the arrays; Blender's own exporters write meshes, its OpenVDB level sets.
"""

# pyright: reportInvalidTypeForm=false, reportOptionalMemberAccess=false, reportArgumentType=false

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy.types import Context, Event, Mesh, Object, Operator

from ...stroke.errors import SculptError
from ...worker.client import JobKind, Message
from ..panels import estimate
from ..scene import level_set, proxy_mesh
from ..scene.commit import PROXY, in_window
from ..scene.properties import field_of, resolution_property, world_scale
from ..session import states
from ..session.job import Job, Request, find
from .launch import REGISTER, Outcome, active_field, field_poll, launch, reports_errors

NETWORK = ".safetensors"
KINDS = {
    **dict.fromkeys((NETWORK, ".pth"), JobKind.SAVE),
    **dict.fromkeys((".obj", ".ply", ".stl", ".glb", ".gltf"), JobKind.MESH),
    level_set.SUFFIX: JobKind.SAMPLE,
}
"""What the worker makes for a file of each suffix."""
DEFAULT_RESOLUTION = 256


class NEURAL_SCULPT_OT_export(Operator):
    """Export the active neural field as a network, a mesh or a level set"""

    bl_idname = "neural_sculpt.export"
    bl_label = "Export Neural Field"
    bl_options = REGISTER

    filepath: StringProperty(
        name="File",
        description="Network: .safetensors or .pth. Mesh: .obj, .ply, .stl, .glb or .gltf."
        " OpenVDB level set: .vdb",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    resolution: resolution_property(
        "Cells along an edge of the field's box, for a mesh or a level set", DEFAULT_RESOLUTION
    )
    filter_glob: StringProperty(
        default=";".join(f"*{suffix}" for suffix in KINDS), options={"HIDDEN"}
    )
    check_existing: BoolProperty(default=True, options={"HIDDEN"})

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field."""
        return field_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for the file."""
        if not self.filepath:
            self.filepath = bpy.path.clean_name(active_field(context).name) + NETWORK
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def draw(self, context: Context) -> None:
        """Draw the resolution and its cost, beside the files."""
        self.layout.prop(self, "resolution")
        estimate.draw(self.layout, active_field(context), self.resolution)

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Have the worker make what the suffix says, and write it."""
        path = Path(bpy.path.abspath(self.filepath))
        kind = KINDS.get(path.suffix.lower())
        if kind is None:
            known = ", ".join(KINDS)
            raise SculptError(f"A field cannot be exported as {path.name}. Use one of {known}.")
        if not path.parent.is_dir():
            raise SculptError(f"There is no folder {path.parent}. Choose another place.")
        if kind is JobKind.SAMPLE:
            level_set.check()
        target = active_field(context).session_uid
        fields = {"path": str(path), "resolution": self.resolution}

        def exported() -> Object:
            if (ob := find(target)) is None:
                raise SculptError(f"{path.name} was not written: the object is gone.")
            return ob

        def request() -> Request:  # when the strokes drawn so far are done
            return states.request(exported(), **fields)

        def write(result: Message) -> None:
            if kind is JobKind.SAVE:  # the worker has done it
                return
            ob = exported()
            if kind is JobKind.SAMPLE:
                level_set.write(path, result.arrays["band"], ob.matrix_world, world_scale(ob))
            else:
                _write_mesh(path, ob, result)

        return launch(self, Job(kind, f"Export {path.name}", request, write))


def _write_mesh(path: Path, ob: Object, result: Message) -> None:
    """Write the result's mesh as if it were the object's: its place, materials, modifiers."""
    with in_window(), _stand_in(ob, result):
        try:
            if path.suffix.lower() in (".glb", ".gltf"):
                kind = "GLB" if path.suffix.lower() == ".glb" else "GLTF_SEPARATE"
                bpy.ops.export_scene.gltf(
                    filepath=str(path), export_format=kind, use_selection=True, export_apply=True
                )
            else:
                export = getattr(bpy.ops.wm, f"{path.suffix.lower()[1:]}_export")
                export(filepath=str(path), export_selected_objects=True)
        except RuntimeError as error:  # an operator's error report
            cause = str(error).strip().removeprefix("Error: ")
            raise SculptError(
                f"{path.name} was not written ({cause}). Choose another folder or file name."
            ) from error


@contextmanager
def _stand_in(ob: Object, result: Message) -> Iterator[None]:
    """A copy of the object with another mesh, alone selected: exporters take what is selected."""
    selected = [*(bpy.context.selected_objects or ())]
    for other in selected:
        other.select_set(False)
    arrays = (result.arrays[name] for name in PROXY)
    geometry = proxy_mesh.geometry(*arrays, smooth=field_of(ob).smooth)
    mesh = bpy.data.meshes.new(ob.name)
    proxy_mesh.fill(mesh, geometry)
    assert isinstance(ob.data, Mesh)
    for material in ob.data.materials:
        mesh.materials.append(material)
    copy = ob.copy()
    copy.data = mesh
    copy.hide_viewport = False
    bpy.context.scene.collection.objects.link(copy)
    copy.select_set(True)
    try:
        yield
    finally:
        bpy.data.objects.remove(copy)
        bpy.data.meshes.remove(mesh)
        for other in selected:
            other.select_set(True)
