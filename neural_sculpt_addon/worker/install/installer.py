# SPDX-License-Identifier: GPL-3.0-or-later
"""The installer: starts the process that installs the worker's environment and reads its progress.

The process writes its progress (see `installation`) into a file that is read now and then, so that
nothing here waits for it. No bpy here.
"""

import contextlib
import json
import logging
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...common.child import exit_in_words, start_logged
from ...common.text import Text, from_json
from . import environment, interpreter

logger = logging.getLogger(__name__)


class Installer:
    """At most one installation."""

    def __init__(self) -> None:
        """Nothing is installed yet."""
        self.fraction = 0.0
        self.message = ""
        self.error = ""
        """Why the last installation failed, for the artist; empty while it did not."""
        self._folder = self._log = Path()
        self._pythons: Iterator[Path] = iter(())  # that are still to be tried
        self._process: subprocess.Popen[bytes] | None = None
        self._cancelled = False

    @property
    def running(self) -> bool:
        """Whether an installation is under way."""
        return self._process is not None and self._process.poll() is None

    def start(self, folder: Path, log: Path) -> None:
        """Begin to make an environment in `folder`; `log` gets what the process says."""
        self.fraction, self.message, self.error = 0.0, "Starting", ""
        self._folder, self._log = folder, log
        self._pythons = interpreter.present_pythons()
        self._process, self._cancelled = None, False
        self._try_next_python()

    def stop(self) -> None:
        """End the installation. An unfinished environment is never taken for a whole one."""
        self._cancelled = True
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()

    def poll(self) -> bool:
        """Take what the process says; whether there may be more. Never blocks."""
        if self._process is None:
            return False
        code = self._process.poll()  # asked first: what it said last is there then
        said = self._log.read_bytes()
        news = _latest(said)
        self.fraction = news.get("fraction", self.fraction)
        self.message = from_json(news.get("message", self.message))
        if code is None:
            return True
        self._process = None
        if self._cancelled and code:
            self.error = "The installation was cancelled."
        elif not news:  # it is no Python, or too old a one
            self._try_next_python()
        elif code:
            ending = exit_in_words(code, said.decode(errors="replace").strip())
            self._fail(
                Text(
                    "The installation stopped unexpectedly ({}). Try again, or see {}.",
                    ending,
                    self._log,
                )
            )
        elif "error" in news:
            self._fail(from_json(news["error"]))
        return self._process is not None

    def _try_next_python(self) -> None:
        for python in self._pythons:
            command = environment.installation_command(python, self._folder)
            try:
                log = self._log.open("wb")
            except OSError as error:
                self._fail(environment.cannot_install(self._folder, error).text)
                return
            with log, contextlib.suppress(OSError):  # it cannot be run
                self._process = start_logged(command, log)
                return
        self._fail(environment.NO_PYTHON)

    def _fail(self, reason: str) -> None:
        self.error = reason
        logger.warning("%s", reason)


def _latest(said: bytes) -> dict[str, Any]:
    """The last of the lines that are news; empty when there is none."""
    for line in reversed(said.splitlines()):
        if line.startswith(b"{"):
            with contextlib.suppress(ValueError):  # it is being written
                return json.loads(line)
    return {}


installer = Installer()
"""The only one."""
