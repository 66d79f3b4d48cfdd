# SPDX-License-Identifier: GPL-3.0-or-later
"""From the installed extension, in a fresh Blender that may not go online and has no worker, to a
sculpted Suzanne, as the README tells it: eight presses of a button or a key, which are counted.

1. Click Add in the header of the viewport,
2. then Neural Field,
3. then Suzanne: the installation of the worker is offered.
4. Click Allow Online Access,
5. then Install; she comes when that is done. Nothing is downloaded here: a Python that has all is
   put into the worker's folder by the process that would have pip do so.
6. Press /, which is View, Local View: she alone is there, without the cube, and fills the view.
7. Click the last tool of the toolbar, Neural Stroke.
8. Draw over her head with the left mouse button.
"""

import os
import shutil
from unittest.mock import patch

import bpy
import harness
import numpy as np
from drawing import (
    PICTURES,
    RESOLUTION,
    SECONDS,
    WindowCase,
    changed,
    choose_tool,
    click,
    field,
    middle,
    opened,
    redo,
    still_picture,
    undo,
)
from geometry import to_path
from harness import brush_settings, module, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Pixel, Steps
from mathutils.bvhtree import BVHTree

ADD = (284, 41)  # of the header's menu, from the upper left
ROW = 20  # pixels of a menu's entry
BLUE = (71, 114, 179)  # of the button that Return presses
CHECK = (300, 31)  # pixels from there to the left and up to what is checked
PRESSES = 8
"""Of the mouse's buttons and of keys, until the first stroke is done."""
INSTALLATION = """
import json, pathlib, sys
folder, python, requirements = sys.argv[1:]
for step in range(5):
    print(json.dumps({"fraction": step / 5, "message": "Installing"}), flush=True)
program = pathlib.Path(folder, "bin", "python")
program.parent.mkdir(parents=True)
program.write_text(f'#!/bin/sh\\nexec "{python}" "$@"\\n')
program.chmod(0o755)
marker = pathlib.Path(folder, "neural_sculpt_environment.txt")
marker.write_bytes(pathlib.Path(requirements).read_bytes())
print(json.dumps({"fraction": 1.0, "message": "The worker is installed"}), flush=True)
"""
FOREHEAD = np.array(  # model space
    [
        *((-0.137, -0.171, 0.517), (-0.054, -0.162, 0.536), (0.026, -0.148, 0.548)),
        *((0.104, -0.131, 0.553), (0.18, -0.112, 0.55), (0.252, -0.087, 0.539)),
        *((0.317, -0.054, 0.518), (0.376, -0.012, 0.487)),
    ]
)


class FirstUse(WindowCase):
    def setUp(self) -> None:
        super().setUp()
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        bpy.context.preferences.addons[harness.EXTENSION].preferences.resolution = RESOLUTION
        bpy.context.preferences.view.smooth_view = 0
        self.forget_worker()

    def forget_worker(self) -> None:
        """There is none, and no leave to fetch one; the installation will take the test's own."""
        system = bpy.context.preferences.system
        self.addCleanup(setattr, system, "use_online_access", system.use_online_access)
        system.use_online_access = False
        self.session.stop()
        self.addCleanup(self.session.stop)
        folder = module("blender.folders").environment_folder()
        shutil.rmtree(folder, ignore_errors=True)
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        environment = module("worker.install.environment")
        python = os.environ[environment.ENVIRONMENT_VARIABLE]
        words = [INSTALLATION, str(folder), python, str(environment.REQUIREMENTS)]
        patched = patch.object(
            environment, "installation_command", lambda python, _: [str(python), "-c", *words]
        )
        patched.start()
        self.addCleanup(patched.stop)
        without = patch.dict(os.environ)
        without.start()
        self.addCleanup(without.stop)
        del os.environ[environment.ENVIRONMENT_VARIABLE]

    def count_presses(self) -> list[str]:
        """What is pressed from now on."""
        presses, event = [], hand.event

        def counted(kind: str, value: str, *given: object) -> None:
            if value == "PRESS":
                presses.append(kind)
            event(kind, value, *given)

        self.enterContext(patch.object(hand, "event", counted))
        return presses

    def test_first_use(self) -> Steps:
        tool = yield from self.tool_button()
        presses = self.count_presses()
        height = hand.screen_pixels().shape[0]
        left, bottom, right, _ = yield from opened((ADD[0], height - ADD[1]))
        entry = (left + right) / 2, bottom + 0.7 * ROW
        left, bottom, right, top = yield from opened(entry, beyond=right)
        suzanne = (left + right) / 2, top - (top - bottom) * 4.5 / 6  # the fifth of six entries
        plain = yield from still_picture()
        yield from click(suzanne)
        dialog = yield from still_picture()
        hand.save_png(PICTURES / "first_use_installation.png", dialog)
        x, y = confirmation(plain, dialog)
        yield from click((x - CHECK[0], y + CHECK[1]))
        self.assertTrue(bpy.context.preferences.system.use_online_access)
        yield from click((x, y))
        yield from hand.until(any_field, SECONDS, "Suzanne")
        yield from self.idle()
        self.assertEqual(field().name, "Suzanne")
        yield from click(tool)
        hand.move(middle())
        away = hand.view().region_3d.view_distance
        hand.tap("SLASH", middle())
        yield from hand.until(
            lambda: hand.view().region_3d.view_distance != away, SECONDS, "Suzanne in a frame"
        )
        self.assertIsNotNone(hand.view().local_view)
        yield from still_picture()
        before, triangles = vertices(field()), corners(field())
        yield from self.draw(FOREHEAD)
        self.assertEqual(len(presses), PRESSES, presses)
        tree = BVHTree.FromPolygons(before.tolist(), triangles.tolist())
        self.check(tree)
        yield from undo()
        np.testing.assert_array_equal(vertices(field()), before)
        yield from redo()
        self.check(tree)

    def check(self, tree: BVHTree) -> None:
        """The surface is higher along the stroke, and nowhere else."""
        brush = brush_settings()
        found = [tree.find_nearest(p) for p in vertices(field()).tolist()]
        nearest = np.array([place for place, _, _, _ in found])
        moved = np.array([distance for _, _, _, distance in found])
        away = to_path(nearest, FOREHEAD)
        inner = to_path(nearest, FOREHEAD[1:-1]) < 0.35 * brush.radius
        self.assertGreater(inner.sum(), 5)
        self.assertAlmostEqual(moved[inner].max() / brush.intensity, 1.0, delta=0.2)
        self.assertLess(moved[away > 1.5 * brush.radius].max(), 0.01)

    def tool_button(self) -> Steps:
        """Where the toolbar has our tool: what changes in the picture when it is chosen."""
        yield 3 * hand.DRAWN
        pictures = []
        for name in ("builtin.cursor", "neural_sculpt.tool"):
            choose_tool(name)
            pictures.append((yield from still_picture()))
        choose_tool("builtin.select_box")
        left, bottom, right, _ = changed(*pictures, hand.region("TOOLS"))
        return (left + right) / 2, bottom + ROW / 2


def confirmation(before: np.ndarray, after: np.ndarray) -> Pixel:
    """The middle of the blue button of a dialog that opened between two pictures."""
    blue = np.abs(after.astype(int) - BLUE).max(axis=2) < 12
    rows, columns = np.nonzero(blue & (np.abs(before.astype(int) - BLUE).max(axis=2) >= 12))
    assert len(rows) > 1000, "no dialog"
    return float(np.median(columns)), after.shape[0] - float(np.median(rows))


def any_field() -> bool:
    """Whether there is a field."""
    return any(ob.neural_sculpt.revision for ob in bpy.data.objects)


def corners(ob: bpy.types.Object) -> np.ndarray:
    """Triangles (F, 3) of a proxy."""
    flat = np.empty(len(ob.data.loops), np.int32)
    ob.data.loops.foreach_get("vertex_index", flat)
    return flat.reshape(-1, 3)
