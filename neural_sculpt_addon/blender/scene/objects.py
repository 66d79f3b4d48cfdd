# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects by their session_uid, which survives undo, where a reference to one does not."""

import bpy
from bpy.types import Object


def find(target: int) -> Object | None:
    """The object with this session_uid, which survives undo; None when it is gone."""
    return next((ob for ob in bpy.data.objects if ob.session_uid == target), None)


def found(target: int) -> Object:
    """The object of a job whose turn it is; the session has made sure that it is there."""
    ob = find(target)
    assert ob is not None
    return ob
