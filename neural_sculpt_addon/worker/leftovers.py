# SPDX-License-Identifier: GPL-3.0-or-later
"""Leftover folders of workers whose Blender was killed. They are removed when the next worker is
started.

Standard library only.
"""

import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

_NAME = re.compile(r"neural_sculpt_(\d+)_")
_STILL_ACTIVE = 259  # of Windows, as the exit code of a process that runs


def make_folder() -> Path:
    """A new private folder that names this process as its owner. OSError when there is no room."""
    return Path(tempfile.mkdtemp(prefix=f"neural_sculpt_{os.getpid()}_"))


def sweep() -> None:
    """Remove the folders of owners that are gone; those of other users are left to them."""
    for path in Path(tempfile.gettempdir()).glob("neural_sculpt_*"):
        name = _NAME.match(path.name)
        if name and not path.is_symlink() and not _runs(int(name[1])):
            shutil.rmtree(path, ignore_errors=True)


def _runs(pid: int) -> bool:
    """Whether a process has this number; when in doubt, yes."""
    if sys.platform == "win32":
        return _runs_on_windows(pid)
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


def _runs_on_windows(pid: int) -> bool:
    """There a signal 0 would be Ctrl C."""
    import ctypes

    kernel = ctypes.windll.kernel32
    process = kernel.OpenProcess(0x1000, False, pid)  # PROCESS_QUERY_LIMITED_INFORMATION
    if not process:
        return kernel.GetLastError() != 87  # ERROR_INVALID_PARAMETER: there is none
    code = ctypes.c_ulong()
    known = kernel.GetExitCodeProcess(process, ctypes.byref(code))
    kernel.CloseHandle(process)
    return not known or code.value == _STILL_ACTIVE
