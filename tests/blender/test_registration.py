# SPDX-License-Identifier: GPL-3.0-or-later
"""Enabling and disabling the extension, and what it must never bring into Blender's process."""

import os
import sys
import tempfile
import unittest
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import bpy
from harness import EXTENSION, brush_settings, module


def traces() -> dict[str, object]:
    """All that a registered add-on leaves in Blender."""
    handlers = {
        name: [handler.__module__ for handler in getattr(bpy.app.handlers, name)]
        for action in ("undo", "redo", "save", "load")
        for name in (f"{action}_pre", f"{action}_post")
    }
    menus = {
        name: [draw.__module__ for draw in getattr(bpy.types, name)._dyn_ui_initialize()]
        for name in ("VIEW3D_MT_add", "VIEW3D_MT_object_convert")
    }
    classes = [name for name in dir(bpy.types) if name.startswith("NEURAL_SCULPT")]
    classes += [op for op in dir(bpy.ops) if op == "neural_sculpt"]
    properties = [
        owner
        for owner in ("Object", "Scene")
        if hasattr(getattr(bpy.types, owner), "neural_sculpt")
    ]
    return {"handlers": handlers, "menus": menus, "classes": classes, "properties": properties}


class Registration(unittest.TestCase):
    def test_leaves_nothing_behind_however_often(self) -> None:
        registration = module("blender.registration")
        registered = traces()
        self.assertEqual(registered["properties"], ["Object", "Scene"])
        registration.unregister()
        clean = traces()
        self.assertNotIn("neural_sculpt", str(clean))
        self.assertNotIn("NEURAL_SCULPT", str(clean))
        for _ in range(20):
            registration.register()
            self.assertEqual(traces(), registered)
            registration.unregister()
            self.assertEqual(traces(), clean)
        registration.register()

    def test_every_class_of_ours_is_registered(self) -> None:
        registration = module("blender.registration")
        named = {cls.__name__ for cls in registration.CLASSES}
        for name, loaded in list(sys.modules.items()):
            if name.startswith(f"{EXTENSION}.blender"):
                ours = {word for word in vars(loaded) if word.startswith("NEURAL_SCULPT_")}
                self.assertLessEqual(ours, named, name)

    def test_extension_is_the_installed_one(self) -> None:
        self.assertEqual(module("blender").ADDON, EXTENSION)
        self.assertIn(EXTENSION, bpy.context.preferences.addons)
        self.assertNotIn("neural_sculpt_addon", sys.modules)

    def test_heavy_packages_stay_out_of_blender(self) -> None:
        loaded = {name.partition(".")[0] for name in sys.modules}
        self.assertFalse(loaded & {"torch", "scipy", "skimage", "trimesh", "igl", "safetensors"})

    def test_every_operator_and_property_has_a_tooltip(self) -> None:
        for cls in module("blender.registration").CLASSES:
            self.assertTrue(cls.__doc__, cls.__name__)
            if issubclass(cls, bpy.types.Operator):
                self.assertFalse(cls.__doc__.endswith("."), f"{cls.__name__}: {cls.__doc__}")


class Tool(unittest.TestCase):
    """In the toolbars and in the add-on's key configuration, where the artist can edit it."""

    def tools(self, mode: str) -> list[str]:
        from bl_ui.space_toolsystem_common import ToolSelectPanelHelper as Toolbars

        found = Toolbars._tool_class_from_space_type("VIEW_3D")._tools[mode]
        return [tool.idname for tool in Toolbars._tools_flatten(found) if tool is not None]

    def keys(self) -> dict[str, list[tuple[str, str, int, int]]]:
        keymaps = bpy.context.window_manager.keyconfigs.addon.keymaps
        return {
            keymap.name: [(i.idname, i.type, i.ctrl, i.shift) for i in keymap.keymap_items]
            for keymap in keymaps
            if "Neural Stroke" in keymap.name
        }

    def test_is_in_both_modes_once(self) -> None:
        for mode in ("OBJECT", "SCULPT"):
            self.assertEqual(self.tools(mode).count("neural_sculpt.tool"), 1, mode)

    def test_icon_is_there(self) -> None:
        icons = Path(bpy.utils.system_resource("DATAFILES")) / "icons"
        self.assertTrue((icons / f"{module('blender.tools').ObjectTool.bl_icon}.dat").is_file())

    def test_keys(self) -> None:
        expected = [
            ("gpencil.annotate", "LEFTMOUSE", False, False),  # with D
            ("neural_sculpt.draw", "LEFTMOUSE", False, False),
            ("neural_sculpt.draw", "LEFTMOUSE", True, False),
            ("neural_sculpt.draw", "LEFTMOUSE", False, True),
            ("neural_sculpt.draw", "LEFTMOUSE", True, True),
            ("neural_sculpt.draw", "P", False, False),
            ("neural_sculpt.draw", "P", False, True),
            ("neural_sculpt.pick_stroke", "J", False, False),
            ("neural_sculpt.no_drag", "LEFTMOUSE", -1, -1),  # a drag, with whatever is held
            ("neural_sculpt.resize", "F", False, False),
            ("neural_sculpt.resize", "F", False, True),
            ("neural_sculpt.resize", "LEFT_BRACKET", False, False),
            ("neural_sculpt.resize", "RIGHT_BRACKET", False, False),
        ]
        keys = self.keys()
        self.assertEqual(len(keys), 2, keys.keys())
        for items in keys.values():
            self.assertCountEqual(items, expected)

    def test_is_gone_with_the_extension(self) -> None:
        registration = module("blender.registration")
        registration.unregister()
        try:
            self.assertEqual([*self.keys().values()], [])
            for mode in ("OBJECT", "SCULPT"):
                self.assertNotIn("neural_sculpt.tool", self.tools(mode))
        finally:
            registration.register()

    def test_brackets_step_the_radius(self) -> None:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        mesh = bpy.data.meshes.new("Field")
        ob = bpy.data.objects.new("Field", mesh)
        bpy.context.collection.objects.link(ob)
        bpy.context.view_layer.objects.active = ob
        self.assertFalse(bpy.ops.neural_sculpt.resize.poll())
        ob.neural_sculpt.revision = "some"
        brush = brush_settings()
        before = brush.radius
        bpy.ops.neural_sculpt.resize(length="RADIUS", factor=1.25)
        self.assertAlmostEqual(brush.radius, 1.25 * before, places=6)
        bpy.ops.neural_sculpt.resize(length="RADIUS", factor=0.8)
        self.assertAlmostEqual(brush.radius, before, places=6)

    def test_the_key_of_the_intensity_changes_the_strength_of_a_brush_that_has_none(self) -> None:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        ob = bpy.data.objects.new("Field", bpy.data.meshes.new("Field"))
        bpy.context.collection.objects.link(ob)
        bpy.context.view_layer.objects.active = ob
        ob.neural_sculpt.revision = "some"
        brush = brush_settings()
        for kind in ("SMOOTH", "FLATTEN", "PINCH"):
            brush.kind, brush.strength, brush.intensity = kind, 0.4, 0.05
            bpy.ops.neural_sculpt.resize(length="INTENSITY", factor=1.5)
            self.assertAlmostEqual(brush.strength, 0.6, places=6)
            self.assertAlmostEqual(brush.intensity, 0.05, places=6)
        brush.kind = "DRAW"
        bpy.ops.neural_sculpt.resize(length="INTENSITY", factor=1.5)
        self.assertAlmostEqual(brush.intensity, 0.075, places=6)

    def test_the_folder_without_an_installation_is_the_users_alone(self) -> None:
        if os.name != "posix":
            self.skipTest("owners and modes of POSIX")
        folders = module("blender.folders")
        with TemporaryDirectory() as temporary, patch.object(tempfile, "tempdir", temporary):
            taken = Path(temporary) / f"neural_sculpt-{os.getuid()}"
            folders.private_folder.cache_clear()
            self.addCleanup(folders.private_folder.cache_clear)
            self.assertEqual(folders.private_folder(), taken)
            self.assertEqual(taken.stat().st_mode & 0o777, 0o700)
            taken.chmod(0o777)
            folders.private_folder.cache_clear()
            other = folders.private_folder()
            self.assertNotEqual(other, taken)
            self.assertEqual(other.stat().st_mode & 0o777, 0o700)
            if os.getuid() == 0:  # only root can give a folder away
                taken.chmod(0o700)
                os.chown(taken, 65534, -1)
                folders.private_folder.cache_clear()
                self.assertNotIn(folders.private_folder(), (taken, other))
            taken.rmdir()
            taken.symlink_to(other)
            folders.private_folder.cache_clear()
            self.assertNotIn(folders.private_folder(), (taken, other))
