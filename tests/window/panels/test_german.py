# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in German: its pictures are for a person to look at."""

import bpy
from drawing import PICTURES, WindowCase, field, still_picture
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps


class German(WindowCase):
    def setUp(self) -> None:
        super().setUp()
        view = bpy.context.preferences.view
        german = {"de", "de_DE"}.intersection(bpy.app.translations.locales)
        if not german:
            self.skipTest("this Blender was packed without languages")
        self.addCleanup(setattr, view, "language", view.language)
        view.language = german.pop()
        view.use_translate_interface = view.use_translate_tooltips = True

    def test_german(self) -> Steps:
        """The sidebar, from its upper end and from its lower one."""
        yield from self.add()
        yield from self.draw(self.arc())
        self.assertEqual(bpy.app.translations.pgettext_iface("Worker"), "Arbeitsprozess")
        yield from hand.show_tab("Neural Sculpt")
        yield from self.keep("german_above")
        region = hand.region("UI")
        with bpy.context.temp_override(window=hand.window(), area=hand.view_area(), region=region):
            for _ in range(30):
                bpy.ops.view2d.scroll_down()
        yield from self.keep("german_below")
        self.assertEqual(len(field().neural_sculpt.strokes), 1)

    def keep(self, name: str) -> Steps:
        """Keep a picture of the window as it is now."""
        hand.region("UI").tag_redraw()
        hand.save_png(PICTURES / f"{name}.png", (yield from still_picture("UI")))
