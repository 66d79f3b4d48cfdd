# SPDX-License-Identifier: GPL-3.0-or-later
"""Files in which strings are of another kind than ours: read without a crash or a trace."""

import tempfile
from pathlib import Path
from typing import Any

import bpy
import harness
from harness import SculptCase


def stored(owner: Any) -> Any:
    """Our properties as Blender keeps them."""
    if hasattr(owner, "bl_system_properties_get"):
        return owner.bl_system_properties_get()["neural_sculpt"]
    return owner["neural_sculpt"]


class Tampered(SculptCase):
    def opened_with(self, **values: Any) -> Any:
        """A field with a stroke, of which a file has other values: `stroke_*` those of the
        stroke."""
        ob = harness.add("SPHERE")
        harness.stroke(harness.arc(ob), name="One", intensity=0.05)
        title, group = ob.name, stored(ob)
        for name, value in values.items():
            of_stroke = name.startswith("stroke_")
            target = group["strokes"][0] if of_stroke else group
            key = name.removeprefix("stroke_")
            del target[key]
            target[key] = value
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "tampered.blend")
            bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
            with self.assertLogs(level="WARNING") as said:
                bpy.ops.wm.open_mainfile(filepath=path)
        self.said = " ".join(said.output)
        return bpy.data.objects[title].neural_sculpt

    def test_text_where_bytes_should_be(self) -> None:
        group = self.opened_with(base_weights="{}", stroke_layer="x")
        self.assertEqual(group.base_weights, b"")
        self.assertEqual(group.strokes[0].layer, b"")
        self.assertIn("base_weights was damaged", self.said)

    def test_bytes_where_text_should_be(self) -> None:
        group = self.opened_with(
            source=b"\xff\xfe", stroke_data=b"\xff" * 1000, stroke_name=b"\xff"
        )
        self.assertEqual(group.source, "")
        self.assertEqual((group.strokes[0].data, group.strokes[0].name), ("", ""))

    def test_the_rest_stays(self) -> None:
        group = self.opened_with(source=b"\xff")
        self.assertGreater(len(group.base_weights), 1000)
        self.assertEqual(group.strokes[0].name, "One")
        self.assertTrue(group.revision)

    def test_a_name_without_end_is_quoted_in_part(self) -> None:
        entry = harness.module("blender.scene.stroke_list").Entry("", "x" * 5000)  # no stroke
        with self.assertRaisesRegex(Exception, "^x{100} was absorbed"):
            entry.stroke  # noqa: B018 - a property
