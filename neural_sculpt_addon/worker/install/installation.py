# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that installs the worker: `python -I -u launch.py install.installation FOLDER`.

Lines of JSON on stdout say how far it is, `{"fraction": 0.5, "message": "Collecting scipy"}`, and
what went wrong, `{"error": "The disk is full. ..."}`. The end of stdin ends it and all that it has
started: whoever asked has cancelled, or is gone. Standard library only, so that any Python that is
new enough can run it.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

from ...common.child import no_window
from ...common.errors import SculptError
from ...common.text import to_json
from . import environment


def main(folder: str) -> None:
    """Install the worker into `folder`."""
    if os.name == "posix":
        os.setpgrp()  # pip and all else that it starts belong to its own group
    threading.Thread(target=_end_with_stdin, daemon=True).start()
    _progress(0.0, "Starting")
    try:
        environment.create(folder, progress=_progress)
    except SculptError as error:
        _say(error=to_json(error.text))


def _progress(fraction: float, message: str) -> None:
    _say(fraction=fraction, message=to_json(message))


def _say(**news: object) -> None:
    sys.stdout.write(json.dumps(news) + "\n")


def _end_with_stdin() -> None:
    while os.read(0, 1):  # not of sys.stdin, which would be locked when this process ends by itself
        pass
    if os.name == "posix":
        os.killpg(0, signal.SIGKILL)
    else:
        kill = Path(os.environ["SYSTEMROOT"]) / "System32" / "taskkill.exe"
        subprocess.run(
            [str(kill), "/F", "/T", "/PID", str(os.getpid())],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            creationflags=no_window(),
            check=False,
        )
