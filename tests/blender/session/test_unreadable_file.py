# SPDX-License-Identifier: GPL-3.0-or-later
"""A file that cannot be opened: the one that is open stays, and all that waits goes on."""

from pathlib import Path

import bpy
import numpy as np
from harness import SteeredCase, field, redo, state, stroke, undo
from test_live_absorption import BrushCase, brush


def fail_to_open(folder: Path) -> None:
    """Open a file that holds no data."""
    path = folder / "damaged.blend"
    path.write_bytes(b"BLENDER-v402" + bytes(64))
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path))
    except RuntimeError:
        return
    raise AssertionError("it was opened")


class WaitingStrokes(SteeredCase):
    def listed(self) -> list[str]:
        return [item.name for item in field("Sphere").neural_sculpt.strokes]

    def test_they_are_sculpted(self) -> None:
        before = state(self.ob)
        for name in ("One", "Two", "Undone"):
            stroke(np.eye(3), name=name)
        undo()
        fail_to_open(self.folder)
        self.assertEqual([job.label for job in self.session.jobs], ["One", "Two"])
        redo()
        self.finish()
        self.assertEqual(self.listed(), ["One", "Two", "Undone"])
        for _ in range(3):
            undo()
        self.assertEqual(state(field("Sphere")), before)


class KeptStrokes(BrushCase):
    def test_undo_follows_them(self) -> None:
        states = [state(self.ob())]
        with self.as_in_a_window():
            for name, right in (("Clay", 0), ("Grab", -40)):
                brush(name, right)
                self.look()
                self.finish()
                states.append(state(self.ob()))
            fail_to_open(self.folder)
            self.undo_and_redo(states, lambda: state(self.ob()))
