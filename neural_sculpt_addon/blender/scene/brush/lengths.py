# SPDX-License-Identifier: GPL-3.0-or-later
"""Radius and intensity that the keys change: the brush's, or those of the stroke whose points are
edited. Model space. A brush that smooths, flattens or pinches has a strength in place of the
intensity.
"""

from dataclasses import replace

from bpy.types import Context

from ....stroke.brush import LARGEST_INTENSITY, LARGEST_RADIUS, LEAST_RADIUS, Brush
from ....stroke.stroke import Kind, Stroke
from .brush_properties import brush_of
from .current_brush import current_kind

RADIUS, INTENSITY, STRENGTH = "radius", "intensity", "strength"


class _State:
    brush: Brush | None = None
    kind: Kind = Kind.DRAW


def edit(stroke: Stroke | None) -> None:
    """Let the keys change the brush of a stroke, see `edited`; with None the artist's again."""
    _State.brush = None if stroke is None else stroke.brush
    _State.kind = Kind.DRAW if stroke is None else stroke.kind


def edited() -> Brush | None:
    """The brush of the stroke that is edited, as it has become; None when none is."""
    return _State.brush


def meant(context: Context, length: str) -> str:
    """What a key for the RADIUS or the INTENSITY changes: the STRENGTH of a brush that has no
    intensity."""
    kind = current_kind(context) if _State.brush is None else _State.kind
    return STRENGTH if length == INTENSITY and kind is not Kind.DRAW else length


def get(context: Context, length: str) -> float:
    """The RADIUS or the INTENSITY, or the STRENGTH."""
    if _State.brush is None:
        return getattr(brush_of(context), meant(context, length))
    return getattr(_State.brush, length)


def put(context: Context, length: str, value: float) -> None:
    """Change one of them, within its bounds."""
    if _State.brush is None:
        setattr(brush_of(context), meant(context, length), value)
        return
    most = LARGEST_RADIUS if length == RADIUS else LARGEST_INTENSITY
    least = LEAST_RADIUS if length == RADIUS else -most
    _State.brush = replace(_State.brush, **{length: min(max(value, least), most)})
