# SPDX-License-Identifier: GPL-3.0-or-later
"""What a brush's profile or modulation can be chosen from: formulas, the curve widget, presets.

Choosing a preset loads it into the curve widget, and the widget is what is chosen then.
"""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_tip as tip_
from bpy.props import EnumProperty

from ...interaction.preset_file import BUILT_IN, Preset
from ...stroke.modulation import Modulation
from ...stroke.profile import Profile
from ..locale.translations import OURS
from . import presets, thumbnails

CURVE = "CURVE"
"""The choice of the curve widget instead of a named profile or modulation."""

OWN = "OWN:"
"""Prefix of the identifiers of an artist's presets, so that none can equal that of a formula."""

PAUSE = 0.05
"""Seconds between two pictures, each of which takes some 3 ms."""

Shape = type[Profile] | type[Modulation]
Item = tuple[str, str, str, Any, int]

CURVE_NUMBER, PRESET_NUMBER = 50, 100
"""Number of a choice. Blender files hold it, so it must never come to mean another choice. Formulas
count from 0; presets need none, for they do not stay chosen."""


def fixed_items(shape: Shape) -> list[tuple[str, str, str]]:
    """Items of an enum without presets."""
    word = shape.WORD
    named = [
        (name.upper(), name.replace("_", " ").title(), f"The {name.replace('_', ' ')} {word}")
        for name in shape.FORMULAS
    ]
    return [*named, (CURVE, "Curve", f"The {word} that the curve widget shows")]


def choice_property(
    shape: Shape, description: str, default: str, update: Callable[[Any, Any], None]
) -> Any:
    """An enum of everything; `update` must see to it that no preset stays chosen."""
    return EnumProperty(
        name=shape.WORD.title(),
        description=description,
        items=lambda _owner, _context: _items(
            shape, tuple(loaded_presets(shape).items()), bpy.app.translations.locale
        ),
        default=[*shape.FORMULAS].index(default),
        update=update,
    )


def chosen_preset(shape: Shape, choice: str) -> Preset | None:
    """The preset of that identifier, None when the choice is none."""
    return loaded_presets(shape).get(choice)


def register() -> None:
    """Draw the pictures from now on, one at a time, before they are needed: to draw all of them at
    once would block the window."""
    thumbnails.register()
    if not bpy.app.background:
        _Drawn.next = _pictures()
        bpy.app.timers.register(_draw_next, first_interval=PAUSE)


def unregister() -> None:
    """Forget them."""
    if bpy.app.timers.is_registered(_draw_next):
        bpy.app.timers.unregister(_draw_next)
    _items.cache_clear()
    thumbnails.unregister()


def loaded_presets(shape: Shape) -> dict[str, Preset]:
    """All that can be loaded now, built in and the artist's own, by identifier."""
    built_in = {preset.name.upper(): preset for preset in BUILT_IN if preset.kind == shape.WORD}
    own = {OWN + stem: preset for stem, preset in presets.own(shape.WORD).items()}
    return built_in | own


class _Drawn:
    next: Iterator[int] = iter(())


def _draw_next() -> float | None:
    return None if next(_Drawn.next, None) is None else PAUSE


def _pictures() -> Iterator[int]:
    """The icons of all choices that are built in, each drawn when it is asked for."""
    for shape in (Profile, Modulation):
        for choice, *_ in fixed_items(shape):
            if choice != CURVE:
                yield _formula_icon(shape, choice)
    for preset in BUILT_IN:
        yield _preset_icon(preset)


def _formula_icon(shape: Shape, choice: str) -> int:
    values = shape(choice.lower())(np.linspace(*shape.DOMAIN, 129))
    return thumbnails.icon(f"{shape.WORD} {choice}", shape.WORD, values)


def _preset_icon(preset: Preset) -> int:
    return thumbnails.icon(f"preset {hash(preset)}", preset.kind, thumbnails.sample(preset))


@cache
def _items(shape: Shape, loaded: tuple[tuple[str, Preset], ...], _locale: str) -> list[Item]:
    """Blender does not copy the texts of an item, so they live as long as we do."""
    items: list[Item] = []
    for number, (choice, name, tip) in enumerate(fixed_items(shape)):
        if choice == CURVE:
            items.append((choice, iface_(name), tip_(tip), "FCURVE", CURVE_NUMBER))
            continue
        items.append((choice, iface_(name), tip_(tip), _formula_icon(shape, choice), number))
    for number, (choice, preset) in enumerate(loaded, PRESET_NUMBER):
        tip = tip_("Load this preset into the curve widget")
        items.append((choice, iface_(preset.name, OURS), tip, _preset_icon(preset), number))
    return items
