# SPDX-License-Identifier: GPL-3.0-or-later
"""Export the active field: as a field file, a mesh of any resolution, or a level set.

The worker writes field files, and makes the arrays of the others. Blender's own exporters write
meshes, and its OpenVDB level sets.
"""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy.types import Context, Event, Object, Operator

from ....common.errors import SculptError
from ....common.text import Text
from ....worker.client import JobKind, Message
from ...panels import estimate
from ...scene import next_proxy
from ...scene.extent import refuse_flat
from ...scene.mesh import proxy_mesh
from ...scene.properties import field_of, find, world_scale
from ...scene.proxy_properties import most_triangles_property, refine_property, resolution_property
from ...session import states
from ...session.absorption import live
from ...session.job import Job, Request
from ..job_operator import REGISTER, Outcome, active_field, field_poll, launch, reports_errors
from . import level_set
from .source_mesh import has_faces
from .stand_in import stand_in

FORMATS = (
    ("SAFETENSORS", "Neural Field (.safetensors)", "Network and detail, to go on with"),
    ("PTH", "Network (.pth)", "The format of the paper's authors, for fields without detail"),
    ("OBJ", "Wavefront (.obj)", "A mesh as text, with materials"),
    ("PLY", "Stanford (.ply)", "A mesh"),
    ("STL", "STL (.stl)", "A mesh for 3D printing"),
    ("GLB", "glTF Binary (.glb)", "A mesh with materials in one file"),
    ("GLTF", "glTF Separate (.gltf)", "A mesh with materials in several files"),
    ("VDB", "OpenVDB Level Set (.vdb)", "Signed distances on a grid"),
)
JOB_KINDS = {f".{name.lower()}": JobKind.MESH for name, _, _ in FORMATS}
JOB_KINDS |= {".safetensors": JobKind.SAVE, ".pth": JobKind.SAVE, level_set.SUFFIX: JobKind.SAMPLE}
"""What the worker makes for a file of each suffix."""
GLTF = {".glb", ".gltf"}  # formats that an add-on of Blender's writes
WITH_TEXT = {".ply", ".stl"}  # formats that can be text, but are binary unless asked
DEFAULT_RESOLUTION = 256  # twice the proxy's: a file is made once and kept


class NEURAL_SCULPT_OT_export(Operator):
    """Export the active neural field as a field, a network, a mesh or a level set"""

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
    format: EnumProperty(
        name="Format",
        description="What is written; in scripts the suffix of the file tells",
        items=FORMATS,
        options={"SKIP_SAVE"},
    )
    resolution: resolution_property(
        "Cells along an edge of the field's box, for a mesh or a level set", DEFAULT_RESOLUTION
    )
    refine: refine_property()
    most_triangles: most_triangles_property()
    modifiers: BoolProperty(
        name="Apply Modifiers",
        description="Write the mesh with the modifiers of the object",
        default=True,
    )
    text: BoolProperty(name="ASCII", description="Write text, which is larger and slower")
    filter_glob: StringProperty(
        default=";".join(f"*{suffix}" for suffix in JOB_KINDS), options={"HIDDEN"}
    )
    check_existing: BoolProperty(default=True, options={"HIDDEN"})

    @classmethod
    def poll(cls, context: Context) -> bool:
        """A field."""
        return field_poll(cls, context)

    def invoke(self, context: Context, event: Event) -> Outcome:
        """Ask for the file."""
        group = field_of(active_field(context))
        self.refine, self.most_triangles = group.refine, group.most_triangles
        if not self.filepath:
            self.filepath = bpy.path.clean_name(active_field(context).name)
            self.check(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def check(self, context: Context) -> bool:
        """Give the file name the suffix of the format; whether that changed it."""
        path, suffix = Path(self.filepath), f".{self.format.lower()}"
        if path.suffix.lower() == suffix:
            return False
        stem = path.stem if path.suffix.lower() in JOB_KINDS else path.name
        self.filepath = str(path.with_name(stem + suffix))
        return True

    def draw(self, context: Context) -> None:
        """Draw the format and what can be chosen for it, beside the files."""
        layout = self.layout
        layout.prop(self, "format", text="")
        suffix = f".{self.format.lower()}"
        if JOB_KINDS[suffix] is JobKind.SAVE:
            return
        layout.prop(self, "resolution")
        if JOB_KINDS[suffix] is JobKind.MESH:
            estimate.draw_refinement(layout, self)  # pyright: ignore[reportArgumentType]
            most = self.most_triangles if self.refine else 0
            estimate.draw(layout, active_field(context), self.resolution, most)  # pyright: ignore[reportArgumentType]
            layout.prop(self, "modifiers")
        if suffix in WITH_TEXT:
            layout.prop(self, "text")

    @reports_errors
    def execute(self, context: Context) -> Outcome:
        """Have the worker make what the suffix of the file asks for, and write it."""
        path = Path(bpy.path.abspath(self.filepath))
        kind = JOB_KINDS.get(path.suffix.lower())
        if kind is None:
            known = ", ".join(JOB_KINDS)
            raise SculptError("A field cannot be exported as {}. Use one of {}.", path.name, known)
        if not path.parent.is_dir():
            raise SculptError("There is no folder {}. Choose another place.", path.parent)
        if kind is JobKind.SAMPLE:
            level_set.check()
        if path.suffix.lower() in GLTF and not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
            raise SculptError(
                "Blender's add-on for glTF is disabled. Enable it in the preferences, or use"
                " another format."
            )
        ob = active_field(context)
        if kind is not JobKind.SAVE:
            refuse_flat(ob)
        live.refuse_edits(ob)  # the file would lack what is seen
        live.let_come(ob)
        target = ob.session_uid
        most = self.most_triangles if self.refine else 0
        fields = {"path": str(path), "resolution": self.resolution, "triangles": most}
        modifiers, text = self.modifiers, self.text  # the operator is gone when the worker is done

        def exported() -> Object:
            if (ob := find(target)) is None:
                raise SculptError("{} was not written: the object is gone.", path.name)
            return ob

        def request() -> Request:  # when the strokes drawn so far are done
            return states.request(exported(), **fields)

        def write(result: Message) -> None:
            if kind is JobKind.SAVE:  # the worker has done it
                return
            ob = exported()
            refuse_flat(ob)  # it may have been scaled meanwhile
            if kind is JobKind.SAMPLE:
                level_set.write(path, result.arrays["band"], ob.matrix_world, world_scale(ob))
            else:
                _write_mesh(path, ob, result, modifiers, text)

        def foresee(result: Message) -> bool:
            ob = find(target)
            if ob is None or proxy_mesh.mesh_of(ob).is_editmode:  # which shows no attributes
                return False
            return next_proxy.carries(ob, result)

        job = Job(kind, Text("Export {}", path.name), request, write, reads=target)
        if kind is JobKind.MESH:
            job.foresee = foresee
        return launch(self, job)


def _write_mesh(path: Path, ob: Object, result: Message, modifiers: bool, text: bool) -> None:
    """Write the result's mesh as if it were the object's: its place, materials, modifiers, and what
    hangs on it."""
    if proxy_mesh.mesh_of(ob).is_editmode:  # the artist has left it, a script need not have
        raise SculptError("{} was not written. Leave Edit Mode first.", path.name)
    geometry = next_proxy.next_geometry(ob, result, field_of(ob).smooth)
    with stand_in(ob, geometry) as copy:
        if modifiers and not has_faces(copy):
            raise SculptError(
                "{} was not written: the modifiers of {} leave no face of its mesh. Change them, or"
                " turn Apply Modifiers off.",
                path.name,
                ob.name,
            )
        try:
            _call_exporter(path, modifiers, text)
        except RuntimeError as error:  # an operator's error report
            cause = str(error).strip().removeprefix("Error: ")
            raise SculptError(
                "{} was not written ({}). Choose another folder or file name.", path.name, cause
            ) from error


def _call_exporter(path: Path, modifiers: bool, text: bool) -> None:
    """Let Blender write what is selected. RuntimeError when it cannot."""
    suffix = path.suffix.lower()
    if suffix in GLTF:
        bpy.ops.export_scene.gltf(
            filepath=str(path),
            export_format="GLB" if suffix == ".glb" else "GLTF_SEPARATE",
            use_selection=True,
            export_apply=modifiers,
            export_gn_mesh=modifiers,  # what geometry nodes have put in place of the mesh
        )
        return
    given = {"ascii_format": text} if suffix in WITH_TEXT else {}
    getattr(bpy.ops.wm, f"{suffix[1:]}_export")(
        filepath=str(path), export_selected_objects=True, apply_modifiers=modifiers, **given
    )
