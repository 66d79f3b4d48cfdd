# SPDX-License-Identifier: GPL-3.0-or-later
"""What a brush's profile or modulation can be chosen from: formulas, the curve widget, presets.

Choosing a preset loads it into the curve widget, and the widget is what is chosen then.
"""

from collections.abc import Callable
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
"""How the choice of an artist's preset begins, so that no file can take the place of a formula."""

Shape = type[Profile] | type[Modulation]
Item = tuple[str, str, str, Any, int]

CURVE_NUMBER, PRESET_NUMBER = 50, 100
"""Blender files hold the number of a choice: it must never come to mean another one. Formulas count
from 0; presets do not stay chosen."""


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
    """Draw pictures from now on."""
    thumbnails.register()


def unregister() -> None:
    """Forget them."""
    _items.cache_clear()
    thumbnails.unregister()


def loaded_presets(shape: Shape) -> dict[str, Preset]:
    """All that can be loaded now, built in and the artist's own, by identifier."""
    built_in = {preset.name.upper(): preset for preset in BUILT_IN if preset.kind == shape.WORD}
    own = {OWN + stem: preset for stem, preset in presets.own(shape.WORD).items()}
    return built_in | own


@cache
def _items(shape: Shape, loaded: tuple[tuple[str, Preset], ...], _locale: str) -> list[Item]:
    """Blender does not copy the texts of an item, so they live as long as we do."""
    domain = np.linspace(*shape.DOMAIN, 129)
    items: list[Item] = []
    for number, (choice, name, tip) in enumerate(fixed_items(shape)):
        if choice == CURVE:
            items.append((choice, iface_(name), tip_(tip), "FCURVE", CURVE_NUMBER))
            continue
        values = shape(choice.lower())(domain)
        icon = thumbnails.icon(f"{shape.WORD} {choice}", shape.WORD, values)
        items.append((choice, iface_(name), tip_(tip), icon, number))
    for number, (choice, preset) in enumerate(loaded, PRESET_NUMBER):
        tip = tip_("Load this preset into the curve widget")
        icon = thumbnails.icon(f"{choice} {hash(preset)}", shape.WORD, thumbnails.sample(preset))
        items.append((choice, iface_(preset.name, OURS), tip, icon, number))
    return items
