# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that are repeated about an axis, as Blender's own settings say, in both modes."""

import bpy
import numpy as np
from harness import (
    SculptCase,
    add,
    arc,
    field,
    long,
    module,
    push_undo,
    redo,
    state,
    stroke,
    strokes_of,
    undo,
    vertices,
)

BRUSH = module("blender.scene.brush.current_brush")
RADIUS, INTENSITY, SIZE = 0.12, 0.06, 0.6
ops = bpy.ops.neural_sculpt


def settings() -> object:
    """Where Blender itself has radial symmetry."""
    if bpy.app.version >= (5, 0, 0):
        return bpy.context.active_object.data
    return bpy.context.scene.tool_settings.sculpt


def bumps(count: int, tilt: float = 0.8, first: float = 0.0) -> np.ndarray:
    """Directions (count, 3) around Z, as far from it as the middle of `arc(tilt)`, from -Y on."""
    angle = first - np.pi / 2 + 2 * np.pi * np.arange(count) / count
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.sin(tilt)
    return np.column_stack([around, np.full(count, np.cos(tilt))])


def heights(directions: np.ndarray) -> np.ndarray:
    """Of the surface (N,) in directions (N, 3), in intensities."""
    points = vertices(field("Sphere"))
    size = np.linalg.norm(points, axis=1)
    near = (points / size[:, None]) @ directions.T > 0.998  # (V, N)
    return np.array([size[column].mean() - SIZE for column in near.T]) / INTENSITY


class Radial(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.ob = add("SPHERE")
        self.line = arc(self.ob, spread=0.1, tilt=0.8)

    def draw(self, name: str = "One") -> None:
        stroke(self.line, radius=RADIUS, intensity=INTENSITY, name=name)

    def assert_bumps(self, raised: np.ndarray, flat: np.ndarray) -> None:
        np.testing.assert_allclose(heights(raised), 0.95, atol=0.15)
        np.testing.assert_allclose(heights(flat), 0, atol=0.05)

    def test_in_object_mode(self) -> None:
        settings().radial_symmetry = (1, 1, 4)
        self.draw()
        self.assertEqual(strokes_of(self.ob)[0]["radial"], [1, 1, 4])
        self.assert_bumps(bumps(4), bumps(4, first=np.pi / 4))

    def test_in_sculpt_mode_with_its_mirror(self) -> None:
        bpy.ops.object.mode_set(mode="SCULPT")
        settings().radial_symmetry = (1, 1, 3)
        self.ob.data.use_mirror_z = True
        self.draw()
        listed = strokes_of(self.ob)[0]
        self.assertEqual((listed["radial"], listed["mirror"]), ([1, 1, 3], "Z"))
        upside_down = bumps(3) * (1, 1, -1)
        flat = bumps(3, first=np.pi / 3)
        self.assert_bumps(np.vstack([bumps(3), upside_down]), np.vstack([flat, flat * (1, 1, -1)]))

    def test_undo_replay_and_edit(self) -> None:
        settings().radial_symmetry = (1, 1, 4)
        plain = state(self.ob)
        push_undo("Radial")
        self.draw()
        drawn = state(field("Sphere"))
        undo()
        self.assertEqual(state(field("Sphere")), plain)
        redo()
        self.assertEqual(state(field("Sphere")), drawn)
        uid = field("Sphere").neural_sculpt.strokes[0].uid
        ops.edit_stroke(uid=uid, radial=(1, 1, 2))
        self.assertEqual(strokes_of(field("Sphere"))[0]["radial"], [1, 1, 2])
        self.assert_bumps(bumps(4)[::2], bumps(4)[1::2])
        ops.edit_stroke(uid=uid, intensity=-INTENSITY)
        self.assertEqual(strokes_of(field("Sphere"))[0]["radial"], [1, 1, 2])
        np.testing.assert_allclose(heights(bumps(4)[::2]), -0.95, atol=0.15)
        ops.edit_stroke(uid=uid, radial=(1, 1, 1))
        self.assertNotIn("radial", strokes_of(field("Sphere"))[0])

    @long
    def test_copies_that_leave_the_box_are_left_out(self) -> None:
        """Of a cube that spans 1.7 an eighth of a turn brings an edge out of [-1, 1]^3."""
        bpy.ops.mesh.primitive_cube_add()
        ops.from_mesh(preset="DRAFT")
        before = vertices(bpy.context.active_object)
        edge = before[np.abs(before[:, 2]) < 0.2]
        corner = edge[edge[:, :2].sum(axis=1).argmax()]
        self.assertGreater(np.hypot(*corner[:2]), 1.01)
        settings().radial_symmetry = (1, 1, 8)
        stroke(np.array([corner]), radius=0.15, intensity=0.05)
        self.assertEqual(strokes_of(bpy.context.active_object)[0]["radial"], [1, 1, 8])
        after = vertices(bpy.context.active_object)
        for turns in range(4):
            angle = np.pi / 2 * turns
            c, s = np.cos(angle), np.sin(angle)
            way = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ corner
            near = np.linalg.norm(after - way, axis=1) < 0.1
            away = way[:2] / np.linalg.norm(way[:2])
            reach = (before[:, :2] @ away).max()
            self.assertGreater((after[near, :2] @ away).max(), reach + 0.02)

    def test_too_many_are_refused(self) -> None:
        settings().radial_symmetry = (1, 1, 64)
        self.ob.data.use_mirror_x = self.ob.data.use_mirror_z = True
        before = state(self.ob)
        self.assert_fails(
            "repeated 256 times; at most 128", stroke, points=self.line, radius=RADIUS
        )
        self.assertEqual(state(self.ob), before)

    def test_a_scene_without_settings_repeats_nothing(self) -> None:
        """Before 5.0 they are Sculpt Mode's, and a new scene has none until it is entered."""
        bpy.context.window.scene = bpy.data.scenes.new("Other")
        bpy.context.scene.collection.objects.link(self.ob)
        self.assertEqual(BRUSH.radial_of(bpy.context, self.ob), (1, 1, 1))
