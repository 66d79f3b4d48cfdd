# SPDX-License-Identifier: GPL-3.0-or-later
"""Radius and intensity that the keys change: the brush's, or those of the stroke whose points are
edited. Model space.
"""

from dataclasses import replace

from bpy.types import Context

from ....stroke.brush import LARGEST_INTENSITY, LARGEST_RADIUS, LEAST_RADIUS, Brush
from .brush_properties import brush_of

RADIUS, INTENSITY = "radius", "intensity"


class _State:
    brush: Brush | None = None


def edit(brush: Brush | None) -> None:
    """Let the keys change the brush of a stroke, see `edited`; with None the artist's again."""
    _State.brush = brush


def edited() -> Brush | None:
    """The brush of the stroke that is edited, as it has become; None when none is."""
    return _State.brush


def get(context: Context, length: str) -> float:
    """The RADIUS or the INTENSITY."""
    return getattr(_State.brush or brush_of(context), length)


def put(context: Context, length: str, value: float) -> None:
    """Change one of them, within its bounds."""
    if _State.brush is None:
        setattr(brush_of(context), length, value)
        return
    most = LARGEST_RADIUS if length == RADIUS else LARGEST_INTENSITY
    least = LEAST_RADIUS if length == RADIUS else -most
    _State.brush = replace(_State.brush, **{length: min(max(value, least), most)})
