# SPDX-License-Identifier: GPL-3.0-or-later
"""Settling: when proxies get the normals that they lack (see `kept_steps`), or are renewed (see
`renewal`). Blender evaluates the mesh for either, so both wait until the artist rests."""

import bpy

from ...scene import kept_steps
from . import renewal
from .tracked_proxies import is_at_work, proxies

REST = 2.0
"""Seconds since the last stroke, or since undo and redo: a shorter pause is one between strokes."""


def wait_for_rest(begins: bool = True) -> None:
    """Settle after a rest, if there is anything to settle.

    begins: whether that begins now, even if one has begun before
    """
    if not begins and bpy.app.timers.is_registered(_settle):
        return
    if not kept_steps.is_settled() or renewal.is_due():
        stop()
        bpy.app.timers.register(_settle, first_interval=REST)


def leave_sculpt_mode() -> None:
    """Write normals at once and renew soon: both cost little outside of Sculpt Mode."""
    kept_steps.settle()
    if not bpy.app.timers.is_registered(_settle) and renewal.is_due():
        bpy.app.timers.register(_settle)


def stop() -> None:
    """Do not wait."""
    if bpy.app.timers.is_registered(_settle):
        bpy.app.timers.unregister(_settle)


def _settle() -> float | None:
    if is_at_work() or proxies.have_strokes():
        return REST
    again = renewal.go_on()
    if again is None:
        kept_steps.settle()
    return again
