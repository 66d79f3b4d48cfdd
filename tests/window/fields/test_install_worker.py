# SPDX-License-Identifier: GPL-3.0-or-later
"""The installation of the worker, watched by the timer that no Blender without a window runs."""

import os
import shutil
from unittest.mock import patch

import bpy
from drawing import SECONDS, WindowCase, operate
from harness import module
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps


class InstallWorker(WindowCase):
    def setUp(self) -> None:
        super().setUp()
        system = bpy.context.preferences.system
        self.addCleanup(setattr, system, "use_online_access", system.use_online_access)
        system.use_online_access = True
        environment = module("blender.folders").environment_folder()
        self.addCleanup(shutil.rmtree, environment, ignore_errors=True)
        waiting = self.folder / "constraints.txt"
        os.mkfifo(waiting)  # which pip reads for ever
        self.enterContext(patch.dict(os.environ, {"PIP_CONSTRAINT": str(waiting)}))

    def test_installation_moves_on_and_is_cancelled(self) -> Steps:
        installer = module("worker.install.installer").installer
        operate(bpy.ops.neural_sculpt.install_worker, "EXEC_DEFAULT")
        yield from hand.until(
            lambda: installer.message == "Looking which packages fit", SECONDS, "pip"
        )
        operate(bpy.ops.neural_sculpt.cancel_installation)
        yield from hand.until(lambda: installer.error, SECONDS, "the end")
        self.assertEqual(installer.error, "The installation was cancelled.")
        self.assertFalse(installer.running)
