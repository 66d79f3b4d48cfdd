# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of Blender's history, and borders among them: steps that undo and redo pass over.

Blender takes back an ordinary step by loading the ordinary step before it. Where a step of Sculpt
Mode stands there it loads nothing, and the change would stay. So a change that follows such a step
is preceded by a *border*: an ordinary step that holds the scene as the step of Sculpt Mode left it.
Undo and redo go over a border and what is beyond it in one go, so the artist never meets one:

    native stroke, border, neural stroke     undo: to the border; then, as one, to the native
                                             stroke, which loads nothing, and to what was before it
                                             redo: to the native stroke; then, as one, to the
                                             border, which looks the same, and to the neural stroke

A mesh that shows its field badly is *renewed* when the artist rests (see `renewal`). Nobody asked
for that step: undo passes over it, too, and redo of the change before it goes on to it.

Python can see the history only as text that Blender prints to its standard output, in some 0.1 ms.
Where it has none no step is passed over, and a border goes ahead of each change in Sculpt Mode.
"""

import ctypes
import logging
import os
import re
import sys
import tempfile
from dataclasses import dataclass

import bpy

log = logging.getLogger(__name__)

OURS = "\N{NO-BREAK SPACE}"
"""Last character of the names of steps that nobody asked for. It tells them from the steps of
strokes, which an artist may have named so."""

BORDER = f"Border{OURS}"
"""Name of a border in the menu of the history."""

RENEWED = f"Renewed Proxy{OURS}"
"""Name of a step that brings another proxy of the same field. The artist has not asked for it: undo
passes over it, and redo of the step before goes on to it."""

_STDOUT = 1
_STEP = re.compile(r"^\[(.)[^]]*] +\d+ (\{[^}]*}) type='([^']*)', name='(.*?)'\r?$", re.M | re.S)
"""A step as Blender prints it. A name may have several lines."""
_OF_SCULPT_MODE, _ORDINARY = "Sculpt", "Global Undo"


@dataclass(frozen=True)
class Step:
    """A step of Blender's history; `address` tells steps of one name apart."""

    address: str
    kind: str
    name: str


def active() -> Step | None:
    """The step that the scene is at; None where the history cannot be read."""
    before, _ = steps()
    return before[-1] if before else None


def needs_border() -> bool:
    """Whether a border must go ahead of the next change."""
    step = active()
    return step is None or is_native(step)


def is_native(step: Step) -> bool:
    """Whether a step is one of Sculpt Mode's own, which hold nothing but the sculpted mesh."""
    return step.kind == _OF_SCULPT_MODE


def is_ordinary(step: Step) -> bool:
    """Whether a step holds all data."""
    return step.kind == _ORDINARY


def undo_passes() -> bool:
    """Whether the scene is at a step that nobody asked for, which undo must pass over."""
    before, _ = steps()
    return len(before) > 2 and _is_passed(before[-1])


def redo_passes() -> int:
    """How many steps redo must take before its last one: borders ahead of the next change and,
    where a renewed proxy follows, that change."""
    _, after = steps()
    place = next((i for i, step in enumerate(after) if not _is_passed(step)), len(after) - 1)
    names = [step.name for step in after[place + 1 : place + 3]]
    if names[:1] == [RENEWED]:
        return place + 1
    return place + 2 if names == [BORDER, RENEWED] else max(place, 0)


def _is_passed(step: Step) -> bool:
    return step.name in (BORDER, RENEWED)


def steps() -> tuple[list[Step], list[Step]]:
    """The steps up to the active one, the oldest first, and those that redo would bring."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        if not bpy.ops.ed.undo_history.poll():  # Blender would crash  # pyright: ignore[reportCallIssue]
            return [], []
    try:
        found = [*_STEP.finditer(_printed())]
    except OSError as error:
        log.debug("Blender's history cannot be read: %s", error)
        found = []
    listed = [Step(step[2], step[3], step[4]) for step in found]
    place = 1 + next((i for i, step in enumerate(found) if step[1] == "*"), -1)
    return listed[:place], listed[place:]


def _printed() -> str:
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
