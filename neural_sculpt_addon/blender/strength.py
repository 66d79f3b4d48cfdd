# SPDX-License-Identifier: GPL-3.0-or-later
"""The strength of the stroke that is chosen in the list, as a slider below it.

While it is dragged nothing is changed but the slider: the strength of the stroke and the field that
follows from it change together, once the slider rests. So it belongs to the window manager, of
which Blender makes no undo steps.
"""

# pyright: reportOptionalMemberAccess=false, reportAttributeAccessIssue=false

import time

import bpy
from bpy.types import Object, WindowManager

from ..stroke.errors import SculptError
from . import stroke_list
from .properties import field_of, is_field, strength_property
from .worker_session import session

NAME = "neural_sculpt_strength"
"""Of the slider: WindowManager.neural_sculpt_strength."""

REST = 0.25
"""Seconds without a change after which the slider is taken to be released."""


class _State:
    target: int = -1  # session_uid of the object
    uid: str = ""
    strength: float = 1.0
    changed: float = 0.0


def _chosen() -> tuple[Object, str] | None:
    """The active field and the uid of the stroke chosen in its list."""
    ob = bpy.context.active_object
    uid = stroke_list.active_uid(ob) if ob is not None and is_field(ob) else ""
    return (ob, uid) if ob is not None and uid else None


def _get(_: WindowManager) -> float:
    if (chosen := _chosen()) is None:
        return 1.0
    ob, uid = chosen
    if _State.uid == uid and _State.target == ob.session_uid:
        return _State.strength
    return field_of(ob).strokes[field_of(ob).active_stroke].strength


def _set(_: WindowManager, strength: float) -> None:
    if (chosen := _chosen()) is None:
        return
    ob, uid = chosen
    if _State.uid and _State.uid != uid:
        _apply()
    _State.target, _State.uid = ob.session_uid, uid
    _State.strength, _State.changed = strength, time.monotonic()
    if session.waits:
        _apply()
    elif not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=REST)


def _tick() -> float | None:
    left = _State.changed + REST - time.monotonic()
    if _State.uid and left > 0:
        return left
    _apply()
    return None
