# SPDX-License-Identifier: GPL-3.0-or-later
"""Enabling and disabling the extension, and what it must never bring into Blender's process."""

import sys
import unittest

import bpy
from harness import EXTENSION, module


def traces() -> dict[str, object]:
    """All that a registered add-on leaves in Blender."""
    handlers = {
        name: [handler.__module__ for handler in getattr(bpy.app.handlers, name)]
        for name in ("undo_post", "redo_post", "load_pre", "load_post", "save_pre")
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
