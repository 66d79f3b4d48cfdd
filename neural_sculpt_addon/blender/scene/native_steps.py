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

from . import kept_steps, next_proxy, sculpt_steps
from .mesh import brush_attributes
from .sculpt_steps import BORDER, Step

_OUR_STEPS = "ours"
_state: set[str] = set()


def is_ours() -> bool:
    """Whether the undo that is being done was called by us and not by the artist."""
    return _OUR_STEPS in _state


def names() -> list[str]:
    """What the steps of Sculpt Mode at the end of the history are called, the last one first.

    None where Blender has no standard output to print them to.
    """
    before, _ = sculpt_steps.steps()
    return [step.name for step in takewhile(sculpt_steps.is_native, reversed(before))]


def take_back(mesh: Callable[[], Mesh], first: Step | None) -> bool:
    """Undo the last step of Blender's history, and borders behind it, if it is one of Sculpt Mode
    after the step `first`; whether that was so. The vertices that this step had moved are then
    where they were before it.

    mesh: the mesh that is sculpted, which undo makes another reference
    """
    before, _ = sculpt_steps.steps()
    borders = sum(1 for _ in takewhile(lambda step: step.name == BORDER, reversed(before)))
    before = before[: len(before) - borders]
    if first not in before[:-1] or not sculpt_steps.is_native(before[-1]):
        return False
    kept, count = brush_attributes.read(mesh()), len(mesh().vertices)
    with ours():
        for _ in range(borders + 1):
            bpy.ops.ed.undo()
        if sculpt_steps.active() == before[-1]:  # Blender has forgotten what was before it
            return False
        if len(mesh().vertices) != count:  # of another topology, which is not the brushes' doing
            for _ in range(borders + 1):
                bpy.ops.ed.redo()
            return False
    brush_attributes.write(mesh(), kept)
    return True


@contextmanager
def ours() -> Iterator[None]:
    """While steps are taken that are no wish of the artist. The field follows them."""
    _state.add(_OUR_STEPS)
    window = bpy.context.window_manager.windows[0]
    try:
        with bpy.context.temp_override(window=window):
            yield
            next_proxy.follow()
            kept_steps.follow()
    finally:
        _state.discard(_OUR_STEPS)
