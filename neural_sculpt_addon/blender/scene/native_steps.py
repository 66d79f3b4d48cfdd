# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps in Blender's history that its own brushes have left last, and taking them back.

An absorbed brush stroke is one step of ours that holds the field and the mesh together. The brush's
own step would be a second one for the same stroke, and to load ours, Blender needs an ordinary step
before it: so the brush's is taken back before ours is made. What brushes change beside positions,
masks and face sets, is no part of the field and stays.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import takewhile

import bpy
from bpy.types import Mesh

from . import sculpt_steps
from .mesh import brush_attributes

_OURS = "ours"
_state: set[str] = set()


def is_ours() -> bool:
    """Whether the undo that is being done is one of this module's and no wish of the artist."""
    return _OURS in _state


def names() -> list[str]:
    """What the steps of Sculpt Mode at the end of the history are called, the last one first.

    None where Blender has no standard output to print them to.
    """
    before, _ = sculpt_steps.steps()
    return [step.name for step in takewhile(sculpt_steps.is_native, reversed(before))]


def take_back(mesh: Callable[[], Mesh], is_back: Callable[[], bool]) -> bool:
    """Undo steps of Sculpt Mode until something is so: whether it came to be.

    Otherwise all is as before. mesh: the mesh that is sculpted, which undo makes another reference
    """
    kept, taken = brush_attributes.read(mesh()), 0
    with _ours():
        for _ in names():
            if is_back():
                break
            bpy.ops.ed.undo()
            taken += 1
        back = is_back()
        for _ in range(0 if back else taken):
            bpy.ops.ed.redo()
    if back and taken:
        brush_attributes.write(mesh(), kept)
    return back


@contextmanager
def _ours() -> Iterator[None]:
    _state.add(_OURS)
    window = bpy.context.window_manager.windows[0]
    try:
        with bpy.context.temp_override(window=window):
            yield
    finally:
        _state.discard(_OURS)
