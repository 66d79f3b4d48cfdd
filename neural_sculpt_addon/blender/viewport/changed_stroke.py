# SPDX-License-Identifier: GPL-3.0-or-later
"""Preview of Edit Stroke: a stroke of the history with the dialog's settings, over the surface.

It is an overlay: nothing of it is in the scene, in undo steps or in files. It ends with the dialog.
Blender can close one without telling the operator, so it ends, too, when the field has another
revision or the object another mode.
"""

from dataclasses import dataclass
from functools import partial

import gpu
from bpy.types import Object

from ...interaction.changed_ribbon import changed_ribbons
from ...interaction.ribbon import Ribbon
from ...stroke.stroke import Stroke
from .. import redraw
from ..scene.properties import field_of, find
from ..scene.stroke_list import Entry
from .draw_handler import DrawHandler
from .gpu_drawing import draw_ribbons, over_surface
from .view import lay

BELOW = 0.6
"""Opacity of a ribbon where the surface hides it, as a share of its opacity elsewhere."""


@dataclass(frozen=True)
class ShownChange:
    """The overlay: for which object and stroke it was made, and what is drawn."""

    target: int  # session_uid of the object
    field: tuple[str, str]  # its revision and mode
    stroke: Stroke
    ribbons: tuple[Ribbon, ...]  # model space


class _State:
    shown: ShownChange | None = None


def show(ob: Object, entry: Entry, stroke: Stroke) -> None:
    """Show this stroke in place of the one of an entry of the history."""
    target, field, before = ob.session_uid, _field(ob), _State.shown
    now = target, field, stroke
    if before is not None and (before.target, before.field, before.stroke) == now:
        return
    share = 0.0 if entry.muted else entry.strength
    made = changed_ribbons(entry.stroke, stroke, partial(lay, ob), share, entry.strength)
    _State.shown = ShownChange(*now, made)
    redraw.tag_views()


def hide() -> None:
    """End the preview."""
    if _State.shown is not None:
        _State.shown = None
        redraw.tag_views()


def shown() -> ShownChange | None:
    """The preview, None where there is none or its object is hidden."""
    if (now := _State.shown) is None:
        return None
    ob = find(now.target)
    if ob is None or _field(ob) != now.field:
        _State.shown = None
        return None
    return now if ob.visible_get() else None


def _field(ob: Object) -> tuple[str, str]:
    return field_of(ob).revision, ob.mode


def _draw() -> None:
    """Draw the ribbons twice: faint even where the surface hides them, then in full before it."""
    if (drawn := shown()) is None:
        return
    with over_surface(find(drawn.target)):  # pyright: ignore[reportArgumentType]
        for depth, opacity in (("NONE", BELOW), ("LESS_EQUAL", 1.0)):
            gpu.state.depth_test_set(depth)  # pyright: ignore[reportArgumentType]
            draw_ribbons(drawn.ribbons, opacity)


_handler = DrawHandler(_draw)


def register() -> None:
    """Let Blender call us whenever it draws."""
    _handler.add()


def unregister() -> None:
    """Draw no more."""
    _State.shown = None
    _handler.remove()
