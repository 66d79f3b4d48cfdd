# SPDX-License-Identifier: GPL-3.0-or-later
"""Install Worker: a process of its own that is watched, cancelled, and tells what failed."""

import os
import shutil
import signal
import stat
import sys
import threading
import time
import unittest
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import bpy
from harness import SculptCase, module

SECONDS = 120


class Installation(SculptCase):
    """With Allow Online Access, and a pip that waits for ever to read its constraints."""

    def setUp(self) -> None:
        super().setUp()
        self.installer = module("worker.install.installer").installer
        self.environment = module("blender.folders").environment_folder()
        self.addCleanup(shutil.rmtree, self.environment, ignore_errors=True)
        self.addCleanup(self.end)
        system = bpy.context.preferences.system
        self.addCleanup(setattr, system, "use_online_access", system.use_online_access)
        system.use_online_access = True
        constraints = self.folder / "constraints.txt"
        if hasattr(os, "mkfifo"):
            os.mkfifo(constraints)
        index = {"PIP_CONSTRAINT": str(constraints), "PIP_NO_INDEX": "1"}
        self.enterContext(patch.dict(os.environ, index))

    def until(self, condition: Callable[[], bool]) -> None:
        """Do what the timer does until something is so."""
        end = time.monotonic() + SECONDS
        while not condition():
            self.assertLess(time.monotonic(), end, self.installer.message or "waited in vain")
            module("blender.operators.jobs.install_worker").show_progress()
            time.sleep(0.01)

    def end(self) -> None:
        self.installer.stop()
        self.until(lambda: not self.installer.poll())

    def failure(self) -> str:
        """The error of an installation that is tried now."""
        bpy.ops.neural_sculpt.install_worker()
        self.until(lambda: not self.installer.poll())
        self.assertFalse(self.installer.running)
        self.assertTrue(self.installer.error.endswith("."), self.installer.error)
        return self.installer.error

    def processes(self) -> list[int]:
        """Those that have the environment in their command lines."""
        found = []
        for entry in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                if str(self.environment) in entry.read_text(errors="replace"):
                    found.append(int(entry.parent.name))
            except (FileNotFoundError, ProcessLookupError):
                continue
        return found

    @unittest.skipUnless(sys.platform == "linux", "needs a FIFO and /proc")
    def test_watched_and_cancelled(self) -> None:
        """Up to Blender 5.0 a thread beside it could crash it; pip must not outlive it."""
        bpy.ops.neural_sculpt.install_worker()
        self.until(lambda: self.installer.message == "Looking which packages fit")
        self.assertGreater(self.installer.fraction, 0)
        self.until(lambda: len(self.processes()) == 2)  # with pip
        self.assertEqual([thread.name for thread in threading.enumerate()], ["MainThread"])
        self.assertEqual([*sys._current_frames()], [threading.get_ident()])
        self.assertFalse(bpy.ops.neural_sculpt.install_worker.poll())
        bpy.ops.neural_sculpt.cancel_installation()
        self.until(lambda: not self.installer.poll())
        self.assertEqual(self.installer.error, "The installation was cancelled.")
        self.until(lambda: not self.processes())
        self.assertFalse(module("worker.install.environment").installed(self.environment))
        self.assertTrue(bpy.ops.neural_sculpt.install_worker.poll())

    @unittest.skipUnless(sys.platform == "linux", "needs a FIFO and /proc")
    def test_ends_with_the_extension(self) -> None:
        registration = module("blender.registration")
        bpy.ops.neural_sculpt.install_worker()
        self.until(lambda: len(self.processes()) == 2)
        registration.unregister()
        registration.register()
        self.until(lambda: not self.processes())
        self.until(lambda: not self.installer.running)  # a command line goes before its process

    @unittest.skipUnless(sys.platform == "linux", "needs a FIFO and /proc")
    def test_dies(self) -> None:
        bpy.ops.neural_sculpt.install_worker()
        self.until(lambda: len(self.processes()) == 2)
        os.killpg(min(self.processes()), signal.SIGKILL)
        self.until(lambda: not self.installer.poll())
        self.assertIn("unexpectedly (killed by SIGKILL)", self.installer.error)

    def test_refused(self) -> None:
        self.environment.mkdir(parents=True, exist_ok=True)
        (self.environment / "letter.txt").write_text("dear")
        self.assertIn("already holds other files", self.failure())
        (self.environment / "letter.txt").unlink()

    @unittest.skipUnless(os.name == "posix", "writes a program for the shell")
    def test_a_python_that_does_not_run_is_passed_over(self) -> None:
        self.environment.mkdir(parents=True, exist_ok=True)
        (self.environment / "letter.txt").write_text("dear")
        broken = self.folder / "python3.11"
        broken.write_text("#!/bin/sh\necho no such version\nexit 127\n")
        for mode in (stat.S_IRUSR, stat.S_IRWXU):
            broken.chmod(mode)
            with patch.object(sys, "executable", str(broken)):
                self.assertIn("already holds other files", self.failure())

    def test_no_python(self) -> None:
        with patch.object(
            module("worker.install.interpreter"), "present_pythons", lambda: iter(())
        ):
            self.assertIn("There is no Python 3.11 or newer", self.failure())

    def test_no_place_for_its_news(self) -> None:
        log = module("blender.folders").installation_log()
        log.unlink(missing_ok=True)
        log.mkdir()
        self.addCleanup(log.rmdir)
        self.assertIn("cannot be installed in", self.failure())
