# SPDX-License-Identifier: GPL-3.0-or-later
"""The strength of the stroke that is chosen in the list, as a slider below it.

While it is dragged nothing is changed but the slider: the strength of the stroke and the field that
follows from it change together, when it is released or rests. So it belongs to the window manager,
of which Blender makes no undo steps.
"""

import time
from functools import partial

import bpy
from bpy.app.translations import pgettext_n as n_
from bpy.types import Object, WindowManager

from ...common.errors import SculptError
from .. import notice
from ..scene import stroke_list
from ..scene.properties import field_of, find, is_field, strength_property
from ..scene.undo_step import in_window
from ..session.absorption.tracked_proxies import is_at_work
from ..session.replay import change_history
from ..session.worker_session import session

PROPERTY = "neural_sculpt_strength"
"""Of the slider: WindowManager.neural_sculpt_strength."""

LABEL = n_("Stroke Strength")

RESTS_AFTER = 1.0
"""Seconds without a change after which the slider counts as released. This ends a typed number,
which has no release."""

AFTER_RELEASE = 0.02
"""Seconds after the release of the mouse button until the strength is applied: the slider's last
change comes behind the release."""


class _State:
    waiting: bool = False  # for the slider to rest
    target: int = -1  # session_uid of the object
    uid: str = ""
    strength: float = 1.0
    until: float = 0.0  # on the clock of `time.monotonic`


def _chosen() -> tuple[Object, str] | None:
    """The active field and the uid of the stroke chosen in its list."""
    ob = bpy.context.active_object
    if is_field(ob) and (uid := stroke_list.active_uid(ob)):
        return ob, uid
    return None


def _get(_: WindowManager) -> float:
    if (chosen := _chosen()) is None:
        return 1.0
    ob, uid = chosen
    dragged = (ob.session_uid, uid) == (_State.target, _State.uid)
    if dragged and (_State.waiting or session.pending(ob.session_uid)):
        return _State.strength
    return field_of(ob).strokes[field_of(ob).active_stroke].strength


def _set(_: WindowManager, strength: float) -> None:
    if (chosen := _chosen()) is None:
        return
    ob, uid = chosen
    if _State.waiting and (_State.target, _State.uid) != (ob.session_uid, uid):
        _apply()
    _State.waiting, _State.target, _State.uid = True, ob.session_uid, uid
    _State.strength, _State.until = strength, time.monotonic() + RESTS_AFTER
    if not timers_run():
        _apply()
    elif not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=RESTS_AFTER)
        bpy.app.timers.register(_watch)  # no operator is called while Blender sets a property


def timers_run() -> bool:
    """Whether Blender calls timers, which tell that the slider rests. In the background it calls
    none, and a script that sets the slider sets the strength."""
    return not bpy.app.background


def is_dragged() -> bool:
    """Whether the slider shows a strength that the stroke does not have yet."""
    return _State.waiting


def release() -> None:
    """Apply the strength soon, for the slider was let go."""
    _State.until = time.monotonic() + AFTER_RELEASE
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    bpy.app.timers.register(_tick, first_interval=AFTER_RELEASE)


def finish() -> None:
    """Apply a strength that the stroke does not have yet, before an undo that means it."""
    if _State.waiting:
        _apply()


def _watch() -> None:
    with in_window():
        if _State.waiting and not bpy.app.background:
            bpy.ops.neural_sculpt.watch_release("INVOKE_DEFAULT")  # pyright: ignore[reportAttributeAccessIssue]


def _tick() -> float | None:
    left = _State.until - time.monotonic()
    if left > 0:
        return left
    if is_at_work():
        return AFTER_RELEASE
    if _State.waiting:
        _apply()
    return None


def _apply() -> None:
    """Give the stroke the strength of the slider, and so change the field."""
    ob, uid = find(_State.target), _State.uid
    _State.waiting = False
    if ob is None or uid not in {item.uid for item in field_of(ob).strokes}:
        return
    change = partial(stroke_list.weakened, uid=uid, strength=_State.strength)
    try:
        if (job := change_history(ob, LABEL, change)) is not None:
            session.run(job)
    except SculptError as error:
        notice.tell(error.text)


def register() -> None:
    """Add the slider."""
    slider = strength_property(get=_get, set=_set)
    setattr(WindowManager, PROPERTY, slider)


def unregister() -> None:
    """Remove it."""
    delattr(WindowManager, PROPERTY)
