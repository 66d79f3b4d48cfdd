# SPDX-License-Identifier: GPL-3.0-or-later
"""With the tool in hand, what is not a stroke remains Blender's: selecting and looking around."""

import bpy
import numpy as np
from drawing import WindowCase, corner, field, middle
from harness import state
from in_blender import simulated_input as hand
from in_blender.simulated_input import Pixel, Steps


class Beside(WindowCase):
    def test_selecting_another_object_and_the_field_again(self) -> Steps:
        yield from self.add()
        before = state(field())
        place = (1.4 * self.size, 0, self.size)
        bpy.ops.mesh.primitive_cube_add(size=0.5 * self.size, location=place)
        cube = bpy.context.active_object.name
        hand.window().view_layer.objects.active = field()
        yield hand.DRAWN
        for point, chosen in ((place, cube), ((0, -self.size, 0), field().name)):
            (at,) = hand.to_window([point])
            hand.move(at)
            yield hand.DRAWN
            hand.tap("LEFTMOUSE", at)
            yield 3 * hand.DRAWN
            self.assertEqual(selected(), [chosen])
            self.assertEqual(bpy.context.view_layer.objects.active.name, chosen)
        self.assertFalse(self.session.jobs)
        self.assertEqual(state(field()), before)

    def test_looking_around(self) -> Steps:
        """From the surface and from beside it."""
        yield from self.add()
        before = state(field())
        for place in (corner(), middle()):
            hand.look()
            seen = self.view_matrix()
            yield from self.turn(place)
            self.assertGreater(np.abs(self.view_matrix() - seen).max(), 0.1)
        self.assertFalse(self.session.jobs)
        self.assertEqual(state(field()), before)

    def test_a_drag_beside_the_surface(self) -> Steps:
        yield from self.add()
        before, chosen = state(field()), selected()
        x, y = corner()
        yield from hand.drag([(x + 10 * step, y + 10 * step) for step in range(9)], pause=0.02)
        yield 3 * hand.DRAWN
        self.assertEqual(selected(), chosen)
        self.assertFalse(self.session.jobs)
        self.assertEqual(state(field()), before)

    def test_a_drag_from_an_instance_of_a_field(self) -> Steps:
        """That field is not in the view layer, and cannot become active."""
        yield from self.add()
        bpy.ops.neural_sculpt.add(kind="TORUS")
        yield from self.idle()
        other, scene = bpy.data.objects["Torus"], bpy.context.scene
        assets = bpy.data.collections.new("Assets")
        scene.collection.children.link(assets)
        for collection in other.users_collection:
            collection.objects.unlink(other)
        assets.objects.link(other)
        hand.window().view_layer.layer_collection.children["Assets"].exclude = True
        instance = bpy.data.objects.new("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", assets
        instance.location, instance.scale = (1.2 * self.size, 0, self.size), (0.4,) * 3
        scene.collection.objects.link(instance)
        ob = field()
        hand.window().view_layer.objects.active = ob
        ob.select_set(True)
        yield 3 * hand.DRAWN
        before = state(field())
        ring = np.array(instance.location)
        ring[0] += 0.2 * self.size
        (x, y), *_ = hand.to_window([ring])
        yield from hand.drag([(x, y + 4 * step) for step in range(9)], pause=0.02)
        yield 3 * hand.DRAWN
        self.assertEqual(selected(), [field().name])
        self.assertFalse(self.session.jobs)
        self.assertEqual(state(field()), before)

    def turn(self, place: Pixel) -> Steps:
        """Drag with the middle button."""
        hand.move(place)
        hand.press(place, button="MIDDLEMOUSE")
        for step in range(1, 5):
            yield hand.DRAWN
            last = place[0] + 20 * step, place[1] + 5 * step
            hand.move(last)
        hand.release(last, button="MIDDLEMOUSE")
        yield hand.DRAWN

    def view_matrix(self) -> np.ndarray:
        """Of the camera (4, 4)."""
        return np.array(hand.view().region_3d.view_matrix)


def selected() -> list[str]:
    """Names of what is selected."""
    return [ob.name for ob in hand.window().view_layer.objects if ob.select_get()]
