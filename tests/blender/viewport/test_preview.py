# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes shown before the worker has them: where vertices go, and that they always come back."""

import bpy
import numpy as np
from geometry import square, to_path
from harness import (
    SteeredCase,
    brush_settings,
    field,
    module,
    push_undo,
    redo,
    state,
    stroke,
    undo,
    vertices,
)

preview_attributes = module("blender.scene.mesh.preview_attributes")
proxy_mesh = module("blender.scene.mesh.proxy_mesh")

LINE = np.array([[-0.3, 0.11, 0.0], [0.0, 0.11, 0.0], [0.3, 0.11, 0.0]])
THERE = np.array([[-1.0, -0.05, 1.0], [-1.0, 0.0, 1.0], [-1.0, 0.05, 1.0]])
"""Over the first vertex of the worker's results, and far off the square."""


class SquareCase(SteeredCase):
    """A square stands for the proxy; the worker's answer is not heard until it is asked for."""

    def setUp(self) -> None:
        super().setUp()
        mesh = self.ob.data
        points, triangles = square()
        mesh.clear_geometry()
        mesh.from_pydata(points.tolist(), [], triangles.tolist())
        mesh[proxy_mesh.FILLED] = f"{proxy_mesh.fingerprint(points):08x}"
        push_undo("Square")
        self.before = state(self.ob)
        self.flat = vertices(self.ob)

    def draw(self, name: str = "One", points: np.ndarray = LINE) -> None:
        brush = brush_settings()
        brush.radius, brush.intensity = 0.15, 0.06
        stroke(points, name=name)

    def heights(self) -> np.ndarray:
        return vertices(field("Sphere"))[:, 2]

    def assert_shown(self, strokes: int = 1) -> None:
        self.assertAlmostEqual(self.heights().max(), 0.06 * strokes, delta=0.004 * strokes)

    def assert_gone(self) -> None:
        self.assertEqual(state(field("Sphere")), self.before)
        names = [attribute.name for attribute in field("Sphere").data.attributes]
        self.assertFalse([name for name in names if "neural" in name])


class Preview(SquareCase):
    def test_is_there_at_once_and_gives_way_to_the_result(self) -> None:
        self.draw()
        self.assert_shown()
        still = to_path(self.flat, LINE) > 0.16
        np.testing.assert_array_equal(vertices(self.ob)[still], self.flat[still])
        self.finish()
        self.assertNotEqual(len(vertices(field("Sphere"))), len(self.flat))
        names = [attribute.name for attribute in field("Sphere").data.attributes]
        self.assertFalse([name for name in names if "neural" in name])

    def test_cancelled_the_mesh_returns(self) -> None:
        self.draw()
        bpy.ops.neural_sculpt.cancel()
        self.assert_gone()

    def test_of_two_strokes_one_is_cancelled(self) -> None:
        self.draw()
        self.draw("Two")
        self.assert_shown(2)
        self.session.cancel_job(self.session.jobs[-1])
        self.assert_shown(1)
        self.session.cancel()
        self.assert_gone()

    def test_of_two_strokes_the_second_never_leaves(self) -> None:
        """It is displaced on the first one's result before that is shown, in a poll of its own."""
        self.draw()
        self.draw("Two", THERE)
        preview, heard = module("blender.scene.mesh.preview").preview, []

        def foresee(*given) -> bool:
            heard.append(original(*given))
            return heard[-1]

        original, preview.foresee = preview.foresee, foresee
        self.addCleanup(setattr, preview, "foresee", original)

        self.say("go")
        self.pump(lambda: len(vertices(field("Sphere"))) != len(self.flat))
        self.assertEqual(heard.pop(), False)
        self.assertTrue(all(heard))
        self.assertLess(len(heard), 5)
        self.assertTrue(preview_attributes.is_previewed(field("Sphere").data))
        moved = np.linalg.norm(vertices(field("Sphere"))[0] - THERE[1])
        self.assertAlmostEqual(moved, 0.06, delta=1e-4)

    def test_undo_takes_back_the_stroke_and_nothing_else(self) -> None:
        field("Sphere").location.x = 1.0
        push_undo("Move")
        self.draw()
        undo()
        self.assertFalse(self.session.jobs)
        self.assertEqual(field("Sphere").location.x, 1.0)
        self.assertEqual(self.heights().max(), 0.0)
        undo()
        self.assertEqual(field("Sphere").location.x, 0.0)
        self.assert_gone()

    def test_a_native_step_meanwhile_does_not_keep_it(self) -> None:
        self.draw()
        field("Sphere").location.x = 1.0
        push_undo("Move")  # Blender's own step, with the preview in it
        self.finish()
        drawn = state(field("Sphere"))
        undo()
        self.assertEqual(field("Sphere").location.x, 1.0)
        self.assertEqual(self.heights().max(), 0.0)
        redo()
        self.assertEqual(state(field("Sphere")), drawn)
        undo()
        undo()
        self.assert_gone()

    def test_is_not_saved(self) -> None:
        path = str(self.folder / "field.blend")
        self.draw()
        bpy.ops.wm.save_as_mainfile(filepath=path)
        self.assert_shown()
        bpy.ops.wm.open_mainfile(filepath=path)
        np.testing.assert_array_equal(vertices(field("Sphere")), self.flat)
        self.assertFalse(
            [name for name, _ in field("Sphere").data.attributes.items() if "neural" in name]
        )
        listed = field("Sphere").neural_sculpt.strokes
        self.assertEqual([(item.name, item.muted) for item in listed], [("One", True)])

    def test_what_blender_saved_by_itself_is_mended(self) -> None:
        path = str(self.folder / "field.blend")
        self.draw()
        bpy.data.libraries.write(path, {field("Sphere"), bpy.context.scene})  # calls no handlers
        self.session.cancel()
        bpy.ops.wm.open_mainfile(filepath=path)
        np.testing.assert_array_equal(vertices(field("Sphere")), self.flat)

    def test_shading_follows(self) -> None:
        if bpy.app.version < (4, 5, 0):
            self.skipTest("this Blender knows no free normals")
        mesh = field("Sphere").data
        mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
        up = np.tile(np.float32((0, 0, 1)), len(self.flat))
        mesh.attributes["custom_normal"].data.foreach_set("vector", up)
        self.draw()
        seen = np.empty_like(up)
        mesh.attributes["custom_normal"].data.foreach_get("vector", seen)
        self.assertLess(seen.reshape(-1, 3)[:, 2].min(), 0.9)
        np.testing.assert_allclose(np.linalg.norm(seen.reshape(-1, 3), axis=1), 1, atol=1e-5)
        self.session.cancel()
        mesh.attributes["custom_normal"].data.foreach_get("vector", seen)
        np.testing.assert_array_equal(seen, up)

    def test_a_mesh_of_two_objects_is_left_alone(self) -> None:
        other = bpy.data.objects.new("Other", field("Sphere").data)
        self.draw()
        np.testing.assert_array_equal(vertices(other), self.flat)
