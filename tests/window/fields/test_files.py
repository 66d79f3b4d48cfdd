# SPDX-License-Identifier: GPL-3.0-or-later
"""Files by clicks: File, Export, Neural Field with its formats and options; strokes from a file; a
mesh that becomes a field and keeps its material and color."""

import json

import bpy
from drawing import (
    INTENSITY,
    PICTURES,
    RADIUS,
    SECONDS,
    WindowCase,
    changed,
    click,
    corner,
    field,
    middle,
    opened,
    operate,
    still_picture,
    undo,
    whole_window,
)
from harness import state
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps

FILE = (43, 13)  # of the menu, from the upper left
EXPORT = 140  # pixels of its entry Export above its lower end
ROW = 20  # pixels of a menu's entry


class Files(WindowCase):
    def setUp(self) -> None:
        super().setUp()
        view = bpy.context.preferences.view
        self.addCleanup(setattr, view, "filebrowser_display_type", view.filebrowser_display_type)
        view.filebrowser_display_type = "SCREEN"

    def test_export(self) -> Steps:
        """By clicks to the file browser, the list of formats and one of them."""
        yield from self.add()
        height = hand.screen_pixels().shape[0]
        _, bottom, right, _ = yield from opened((FILE[0], height - FILE[1]))
        entry = right - 60, bottom + EXPORT
        left, bottom, right, _ = yield from opened(entry, beyond=right + 2, press=False)
        hand.save_png(PICTURES / "export_menu.png", hand.screen_pixels())
        yield from click(((left + right) / 2, bottom + 0.7 * ROW))
        yield from hand.until(browsers, SECONDS, "a file browser")
        yield 5 * hand.DRAWN
        self.assertEqual(chosen().bl_idname, "NEURAL_SCULPT_OT_export")
        self.assertEqual(chosen().format, "SAFETENSORS")
        button = yield from self.format_button()
        whole = whole_window()
        yield from click(button)
        formats = yield from still_picture(whole)
        hand.save_png(PICTURES / "export_formats.png", formats)
        hand.tap("S", button)  # for Stanford
        yield from hand.until(lambda: chosen().format == "PLY", SECONDS, "another format")
        yield 5 * hand.DRAWN
        hand.save_png(PICTURES / "export_ply.png", hand.screen_pixels())
        parameters = browsers()[0].spaces.active.params
        self.assertEqual(parameters.filename, "Sphere.ply")
        parameters.directory = bytes(self.folder)
        chosen().resolution = 32
        yield 5 * hand.DRAWN
        place = whole.width / 2, whole.height / 2
        hand.move(place)
        yield hand.DRAWN
        hand.tap("RET", place)
        written = self.folder / "Sphere.ply"
        yield from hand.until(written.exists, SECONDS, "a file")
        yield from self.idle()
        self.assertEqual(written.read_bytes()[:3], b"ply")

    def format_button(self) -> Steps:
        """Where the format is chosen: at the top of what changes with it."""
        pictures = []
        for name in ("VDB", "SAFETENSORS"):
            chosen().format = name
            for region in browsers()[0].regions:
                region.tag_redraw()
            yield 5 * hand.DRAWN
            pictures.append((yield from still_picture(whole_window())))
        hand.save_png(PICTURES / "export_vdb.png", pictures[0])
        left, _, right, top = changed(*pictures, whole_window(), least=20)
        return (left + right) / 2, top - 4

    def test_strokes_from_a_file(self) -> Steps:
        """The button of the panel Stroke, a name and Enter; Ctrl Z takes all of them back."""
        yield from self.add()
        before = state(field())
        paths = self.arc(0.4), self.arc(-0.4)
        brush = {"radius": RADIUS, "intensity": INTENSITY}
        strokes = [{"points": path.tolist(), **brush} for path in paths]
        file = self.folder / "strokes.json"
        file.write_text(json.dumps({"version": 1, "strokes": strokes}))
        view = bpy.context.preferences.view
        self.addCleanup(setattr, view, "ui_scale", view.ui_scale)
        view.ui_scale = 0.6
        yield from hand.show_tab("Neural Sculpt")
        yield from click((yield from self.last_button_of_stroke()))
        yield from hand.until(browsers, SECONDS, "a file browser")
        yield 5 * hand.DRAWN
        self.assertEqual(chosen().bl_idname, "NEURAL_SCULPT_OT_strokes_from_file")
        parameters = browsers()[0].spaces.active.params
        parameters.directory, parameters.filename = bytes(self.folder), file.name
        yield 5 * hand.DRAWN
        place = whole_window().width / 2, whole_window().height / 2
        hand.move(place)
        yield hand.DRAWN
        hand.tap("RET", place)
        yield from self.strokes_are(2)
        self.assert_raised(*paths)
        yield from undo()
        self.assertEqual(state(field()), before)

    def last_button_of_stroke(self) -> Steps:
        """Where From File is: the lowest of what is grey when the field is locked, without any
        stroke in the history below."""
        pictures = []
        for lock in (True, False):
            if lock:
                field().shape_key_add(name="Basis")
            else:
                field().shape_key_clear()
            hand.region("UI").tag_redraw()
            hand.move(corner())
            pictures.append((yield from still_picture("UI")))
        left, bottom, right, _ = changed(*pictures, hand.region("UI"))
        return (left + right) / 2, bottom + 4

    def test_a_mesh_becomes_a_field(self) -> Steps:
        """Its dialog is confirmed by Enter; material and color are those of the mesh."""
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.6)
        source = bpy.context.active_object
        wax = bpy.data.materials.new("Wax")
        wax.diffuse_color = (0.8, 0.3, 0.2, 1.0)
        source.data.materials.append(wax)
        source.color = (0.2, 0.6, 0.3, 1.0)
        hand.move(middle())
        yield hand.DRAWN
        operate(bpy.ops.neural_sculpt.from_mesh, preset="DRAFT")
        dialog = yield from still_picture()
        hand.save_png(PICTURES / "from_mesh_dialog.png", dialog)
        hand.tap("RET", middle())
        yield from hand.until(
            lambda: any(ob.neural_sculpt.revision for ob in bpy.data.objects), SECONDS, "a field"
        )
        yield from self.idle()
        self.assertEqual([slot.material.name for slot in field().material_slots], ["Wax"])
        for color in ("MATERIAL", "OBJECT"):
            hand.view().shading.color_type = color
            hand.move(corner())
            picture = yield from still_picture()
            hand.save_png(PICTURES / f"from_mesh_{color.lower()}.png", picture)
            x, y = middle()
            red, green, _ = map(int, picture[picture.shape[0] - int(y) - 40, int(x) - 40])
            self.assertGreater(red - green if color == "MATERIAL" else green - red, 30)


def browsers() -> list[bpy.types.Area]:
    """The file browsers of the window."""
    return [area for area in hand.window().screen.areas if area.type == "FILE_BROWSER"]


def chosen() -> bpy.types.Operator:
    """The operator for which a file is chosen."""
    return browsers()[0].spaces.active.active_operator
