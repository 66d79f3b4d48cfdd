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
import numpy as np
from bpy.types import Mesh

from . import sculpt_steps

KEPT = {
    ".sculpt_mask": ("FLOAT", "POINT", np.float32),
    ".sculpt_face_set": ("INT", "FACE", np.int32),
    ".hide_vert": ("BOOLEAN", "POINT", np.bool_),
    ".hide_edge": ("BOOLEAN", "EDGE", np.bool_),
    ".hide_poly": ("BOOLEAN", "FACE", np.bool_),
}
"""Attributes that brushes change and the field does not know: type, domain, type of an array."""

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
    kept, taken = _read(mesh()), 0
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
        _write(mesh(), kept)
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


def _read(mesh: Mesh) -> dict[str, np.ndarray]:
    """The attributes that are there."""
    found = {}
    for name, (_, _, dtype) in KEPT.items():
        if (attribute := mesh.attributes.get(name)) is not None:
            found[name] = np.empty(len(attribute.data), dtype)  # pyright: ignore
            attribute.data.foreach_get("value", found[name])  # pyright: ignore
    return found


def _write(mesh: Mesh, kept: dict[str, np.ndarray]) -> None:
    """Bring the attributes back to what they were."""
    now = _read(mesh)
    for name, values in kept.items():
        if name not in now:
            kind, domain, _ = KEPT[name]
            mesh.attributes.new(name, kind, domain)  # pyright: ignore
        elif np.array_equal(now[name], values):
            continue
        mesh.attributes[name].data.foreach_set("value", values)  # pyright: ignore
