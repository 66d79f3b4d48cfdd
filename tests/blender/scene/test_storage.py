# SPDX-License-Identifier: GPL-3.0-or-later
"""No byte of a field is lost: overwriting, undo, save and load, append, copies."""

import random
import shutil

import bpy
from harness import SculptCase, push_undo

RANDOM = random.Random(7)
VALUES = [
    RANDOM.randbytes(140_000),
    RANDOM.randbytes(70_001),
    b"\0" * 50,
    b"ab\0cd\0\0",
    bytes(300) + b"x",
    bytes(range(256)) * 10,
    b"",
    RANDOM.randbytes(200_000),
]


class Storage(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        ob = bpy.data.objects.new("Store", None)
        bpy.context.scene.collection.objects.link(ob)

    def put(self, value: bytes) -> None:
        bpy.data.objects["Store"].neural_sculpt.weights = value

    def get(self) -> bytes:
        return bpy.data.objects["Store"].neural_sculpt.weights

    def test_overwriting(self) -> None:
        for value in VALUES * 2:
            self.put(value)
            self.assertEqual(self.get(), value)

    def test_undo_and_redo(self) -> None:
        for value in VALUES:
            self.put(value)
            push_undo("Put")
        self.undo_and_redo(VALUES, self.get)

    def test_save_load_and_append(self) -> None:
        path, copy = str(self.folder / "a.blend"), str(self.folder / "b.blend")
        for value in VALUES:
            self.put(value)
            bpy.ops.wm.save_as_mainfile(filepath=path)
            bpy.ops.wm.open_mainfile(filepath=path)
            self.assertEqual(self.get(), value)
            shutil.copy(path, copy)
            with bpy.data.libraries.load(copy) as (_, wanted):
                wanted.objects = ["Store"]
            self.assertEqual(wanted.objects[0].neural_sculpt.weights, value)

    def test_copy(self) -> None:
        for value in VALUES:
            self.put(value)
            self.assertEqual(bpy.data.objects["Store"].copy().neural_sculpt.weights, value)

    def test_long_text(self) -> None:
        item = bpy.data.objects["Store"].neural_sculpt.strokes.add()
        item.data = text = '{"é": "' + "ü" * 500_000 + '"}'
        self.assertEqual(item.data, text)
