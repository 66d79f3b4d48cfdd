# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes and orders by the screen's own mouse and keyboard."""

import bpy
from drawing import WindowCase, edited, field, middle
from hands import OrderCase, PersonHands, draw, focus, mouse, person
from harness import long, state
from hasty_orders import HastyHands, HastyOrder
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from undo_orders import Order


class Person(WindowCase):
    def test_person(self) -> Steps:
        yield from self.add()
        before = state(field())
        path = self.arc()
        focus()
        yield from draw(path)
        yield from self.strokes_are(1)
        self.assert_raised(path)
        person(*mouse(middle()), "key", "ctrl+z")
        yield from hand.until(lambda: state(field()) == before, 30, "the field without the stroke")

    def test_d_annotates(self) -> Steps:
        """As with Blender's own tools, while ours is chosen."""
        yield from self.add()
        before = state(field())
        focus()
        person("keydown", "d")
        yield from draw(self.arc())
        person("keyup", "d")
        yield from hand.until(lambda: annotated() == 1, 30, "an annotation")
        self.assertEqual(state(field()), before)


class PersonOrders(OrderCase):
    @long
    def test_orders(self) -> Steps:
        """Each press of Ctrl Z takes back one thing, each of Shift Ctrl Z brings it back."""
        yield from self.add()
        yield from Order("person", PersonHands(self, 0), field().name).play_borders()

    @long
    def test_random_order(self) -> Steps:
        yield from self.add()
        yield from Order("person", PersonHands(self, 0), field().name).play()

    @long
    def test_random_order_of_live_strokes(self) -> Steps:
        self.live = True
        yield from self.add()
        yield from Order("live person", PersonHands(self, 0), field().name).play()

    @long
    def test_random_order_of_live_strokes_that_bring_another_proxy(self) -> Steps:
        if bpy.app.version < (5, 0, 0):
            self.skipTest("this Blender brings it with the stroke")
        self.live = self.off = True
        yield from self.add()
        yield from Order("off person", PersonHands(self, 0), field().name).play()

    @long
    def test_a_stroke_after_a_brush_stroke_that_was_undone(self) -> Steps:
        """Blender up to 4.5 rounds what it takes back, which is no sculpting."""
        yield from self.add()
        hands = PersonHands(self, 0)
        for thing in (hands.toggle_mode, hands.native, hands.undo):
            yield from thing()
        self.assertFalse(edited())
        yield from hands.neural()

    @long
    def test_hasty_order(self) -> Steps:
        self.live = True
        yield from self.add()
        yield from HastyOrder("hasty person", HastyHands(self, 0), field().name).play()


def annotated() -> int:
    """How many strokes annotations have."""
    blocks = bpy.data.annotations if hasattr(bpy.data, "annotations") else bpy.data.grease_pencils
    layers = [layer for block in blocks for layer in block.layers]
    return sum(len(frame.strokes) for layer in layers for frame in layer.frames)
