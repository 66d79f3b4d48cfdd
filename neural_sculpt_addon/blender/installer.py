# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs the worker's environment in a thread, so that Blender stays usable. No bpy here."""

import logging
import threading
from pathlib import Path

from ..stroke.errors import Cancelled, SculptError
from ..worker import environment

log = logging.getLogger(__name__)


class Installer:
    """At most one installation; its plain attributes may be read from any thread."""

    def __init__(self) -> None:
        """Nothing is installed yet."""
        self.fraction = 0.0
        self.message = ""
        self.error = ""
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()

    @property
    def running(self) -> bool:
        """Whether an installation is under way."""
        return self._thread is not None and self._thread.is_alive()

    def start(self, folder: Path) -> None:
        """Begin to make an environment in `folder`."""
        self.fraction, self.message, self.error = 0.0, "Starting", ""
        self._stop.clear()
        self._thread = threading.Thread(target=self._install, args=(folder,), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ask the installation to stop; what is unfinished is never taken for an environment."""
        self._stop.set()

    def _install(self, folder: Path) -> None:
        try:
            environment.create(folder, progress=self._progress)
        except Cancelled:
            self.error = "The installation was cancelled."
        except SculptError as error:
            self.error = str(error)
            log.warning("%s", error)

    def _progress(self, fraction: float, message: str) -> None:
        if self._stop.is_set():
            raise Cancelled
        self.fraction, self.message = fraction, message


installer = Installer()
"""The only one."""
