# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the last step of Blender's history is one of Sculpt Mode's own.

Blender takes back an ordinary undo step by loading the one before it, which it does only when that
is an ordinary one, too. After a step of Sculpt Mode a change must therefore be preceded by an
ordinary step that holds the scene as it was, or Ctrl Z would leave the change in place.

Python can see the history only as text that Blender prints to its standard output.
"""

import ctypes
import logging
import os
import sys
import tempfile

import bpy

log = logging.getLogger(__name__)

_STDOUT = 1
_OF_SCULPT_MODE = "type='Sculpt'"


def last_is_of_sculpt_mode() -> bool:
    """Whether an ordinary step must go ahead of the next change; some 0.1 ms.

    Where Blender has no standard output to look at, yes: a step that changes nothing is no harm.
    """
    try:
        steps = printed()
    except OSError as error:
        log.debug("Blender's history cannot be read: %s", error)
        return True
    active = [line for line in steps.splitlines() if line.startswith("[*")]
    return not active or _OF_SCULPT_MODE in active[-1]


def printed() -> str:
    """Blender's history as it prints it. OSError where it cannot print."""
    system = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)
    with tempfile.TemporaryFile() as file:
        system.fflush(None)  # what was printed before
        kept = os.dup(_STDOUT)
        try:
            os.dup2(file.fileno(), _STDOUT)
            bpy.context.window_manager.print_undo_steps()
            system.fflush(None)
        finally:
            os.dup2(kept, _STDOUT)
            os.close(kept)
        file.seek(0)
        return file.read().decode(errors="replace")
