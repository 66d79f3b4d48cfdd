# SPDX-License-Identifier: GPL-3.0-or-later
"""The alpha of the brush: what is chosen is what a stroke has, and undo leaves it alone."""

import math

import bpy
import numpy as np
from bpy.types import Image
from harness import (
    SculptCase,
    add,
    arc,
    brush_settings,
    field,
    module,
    push_undo,
    stroke,
    strokes_of,
    undo,
    vertices,
)

ops = bpy.ops.neural_sculpt


def image_of(rgba: np.ndarray, name: str = "Painted") -> Image:
    """An image of this scene with pixels (H, W, 4), the first row on top."""
    height, width = rgba.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True)
    image.pixels.foreach_set(np.ascontiguousarray(rgba[::-1], np.float32).ravel())
    return image


def opaque(grey: np.ndarray) -> np.ndarray:
    return np.concatenate([np.repeat(grey[..., None], 3, axis=2), np.ones((*grey.shape, 1))], 2)


class Alphas(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.brush = brush_settings()
        self.Alpha = module("stroke.alpha").Alpha

    def greys(self) -> np.ndarray:
        """The brush's image, its first row on top."""
        pixels = self.Alpha.from_json({"pixels": self.brush.alpha_pixels}).pixels
        return np.frombuffer(pixels, np.uint8).reshape(2 * [math.isqrt(len(pixels))])

    def test_a_stroke_has_the_alpha_that_was_chosen_and_can_be_edited(self) -> None:
        ob = add()
        self.assertEqual(self.brush.alpha, "NONE")
        self.brush.alpha, self.brush.alpha_angle, self.brush.alpha_spacing = "RIVET", 0.5, 1.5
        stroke(arc(ob))
        self.assertEqual(
            strokes_of(ob)[0]["alpha"], {"name": "rivet", "angle": 28.648, "spacing": 1.5}
        )
        raised = np.linalg.norm(vertices(ob), axis=1)
        self.assertGreater(raised.max(), 0.63)
        uid = ob.neural_sculpt.strokes[0].uid
        ops.edit_stroke(uid=uid, alpha_angle=math.radians(-90))
        self.assertEqual(
            strokes_of(ob)[0]["alpha"], {"name": "rivet", "angle": -90, "spacing": 1.5}
        )
        ops.edit_stroke(uid=uid, alpha="STAR", alpha_spacing=3.0)
        self.assertEqual(strokes_of(ob)[0]["alpha"], {"name": "star", "angle": -90, "spacing": 3})
        ops.edit_stroke(uid=uid, radius=0.12)
        self.assertEqual(strokes_of(ob)[0]["alpha"], {"name": "star", "angle": -90, "spacing": 3})
        ops.edit_stroke(uid=uid, alpha="NONE")
        self.assertNotIn("alpha", strokes_of(ob)[0])

    def test_undo_leaves_it_alone_and_the_file_keeps_it(self) -> None:
        add()
        push_undo("Before")
        image_of(opaque(np.tile(np.linspace(0, 1, 16), (16, 1))))
        ops.alpha_image(image="Painted")
        self.brush.alpha_angle, self.brush.alpha_spacing = 0.25, 4.0
        kept = self.brush.alpha_pixels
        push_undo("After")
        undo()
        for _ in range(2):
            brush = brush_settings()
            self.assertEqual(brush.alpha, "IMAGE")
            self.assertEqual(brush.alpha_pixels, kept)
            self.assertEqual((brush.alpha_angle, brush.alpha_spacing), (0.25, 4.0))
            path = str(self.folder / "saved.blend")
            bpy.ops.wm.save_as_mainfile(filepath=path)
            bpy.ops.wm.open_mainfile(filepath=path)
        stroke(arc(field("Sphere")))
        saved = strokes_of(field("Sphere"))[0]["alpha"]
        self.assertEqual(saved, {"pixels": kept, "angle": 14.324, "spacing": 4.0})

    def test_an_image_is_grey_by_luminance_where_it_is_opaque(self) -> None:
        rgba = np.zeros((4, 4, 4))
        rgba[..., 3] = 1
        rgba[0] = 1  # white on top
        rgba[1, :, :] = [1, 0, 0, 1]
        rgba[2, :, :] = [0, 1, 0, 0.5]
        image_of(rgba)
        ops.alpha_image(image="Painted")
        np.testing.assert_allclose(self.greys()[:, 0], [255, 54, 91, 0], atol=1)

    def test_a_file_is_reduced_and_leaves_nothing_behind(self) -> None:
        grey = np.kron(np.array([[0.0, 1.0], [1.0, 0.0]]), np.ones((300, 300)))
        image = image_of(opaque(grey))
        path = str(self.folder / "checker.png")
        image.filepath_raw, image.file_format = path, "PNG"
        image.save()
        bpy.data.images.remove(image)
        ops.alpha_image(filepath=path)
        self.assertEqual(len(bpy.data.images), 0)
        self.assertEqual(self.brush.alpha, "IMAGE")
        greys = self.greys()
        self.assertEqual(greys.shape, (128, 128))
        self.assertEqual(greys[[0, 0, -1, -1], [0, -1, 0, -1]].tolist(), [0, 255, 255, 0])

    def test_what_is_no_image_is_refused(self) -> None:
        text = self.folder / "text.png"
        text.write_text("no picture")
        self.assert_fails("Choose another", ops.alpha_image, filepath=str(text))
        self.assert_fails("Choose another", ops.alpha_image, filepath=str(self.folder / "none"))
        self.assert_fails("Choose another", ops.alpha_image, image="Nobody")
        image_of(opaque(np.zeros((4, 4))), "Black")
        self.assert_fails("black", ops.alpha_image, image="Black")
        self.assertEqual(self.brush.alpha, "NONE")
        self.assertEqual([image.name for image in bpy.data.images], ["Black"])

    def test_without_an_image_a_stroke_says_so(self) -> None:
        ob = add()
        self.brush.alpha = "IMAGE"
        self.assert_fails("No image was chosen", stroke, points=arc(ob))
        self.brush.alpha_pixels = "damaged"
        self.assert_fails("No image was chosen", stroke, points=arc(ob))
        self.brush.kind = "SMOOTH"  # has no alpha
        self.brush.radius = 0.2
        drawn = module("blender.scene.brush.current_brush").brush_stroke(bpy.context, ob, arc(ob))
        self.assertIsNone(drawn.brush.alpha)

    def test_the_preview_shows_it(self) -> None:
        ob = add()
        self.brush.alpha, self.brush.radius = "RIVET", 0.25
        drawn = module("blender.scene.brush.current_brush").brush_stroke(
            bpy.context, ob, arc(ob)[4:5]
        )
        corners = np.array([list(face.vertices) for face in ob.data.polygons], np.int32)
        displaced = module("interaction.displaced")
        heights = []
        for alpha in (drawn.brush.alpha, None):
            shape = displaced.Displaced(vertices(ob), corners)
            shape.add(
                module("stroke.stroke").replace(
                    drawn, brush=module("stroke.stroke").replace(drawn.brush, alpha=alpha)
                )
            )
            shown = vertices(ob)
            shown[shape.vertices] = shape.positions
            heights.append(np.linalg.norm(shown, axis=1))
        self.assertAlmostEqual(heights[0].max(), heights[1].max(), delta=1e-3)
        self.assertGreater((heights[1] - heights[0]).max(), 0.003)
        self.assertGreater((heights[1] - heights[0]).min(), -1e-6)

    def test_pictures_show_the_images_upright(self) -> None:
        thumbnails = module("blender.presets.thumbnails")
        picture = thumbnails.draw_alpha(self.Alpha("star"))
        self.assertEqual(picture.shape, (64, 64, 4))
        tips = picture[[58, 5], 32, 0]  # of the five points one is on top
        self.assertGreater(tips[0], 0.02)
        self.assertEqual(tips[1], 0)
