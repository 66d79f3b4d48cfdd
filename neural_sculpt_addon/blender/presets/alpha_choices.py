# SPDX-License-Identifier: GPL-3.0-or-later
"""What a brush's alpha can be chosen from: none, what comes with the extension, an artist's image.

The image is kept as text, as in a stroke file.
"""

import math
from functools import lru_cache
from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_tip as tip_
from bpy.props import EnumProperty, FloatProperty

from ...common.errors import SculptError
from ...stroke.alpha import LARGEST_SPACING, LEAST_SPACING, NATURAL_SPACING, Alpha
from ...stroke.alpha_images import IMAGES
from . import thumbnails
from .shape_choices import Item

NONE, IMAGE = "NONE", "IMAGE"
MOST_KEPT = 64  # images of artists, the last ones looked at

IMAGE_NUMBER = 50
"""Number of a choice, as Blender files hold it: 0 for none, from 1 for images of the extension."""


def fixed_items() -> list[tuple[str, str, str]]:
    """Items of an enum."""
    return [
        (NONE, "None", "The profile alone"),
        *((name.upper(), name.title(), "") for name in IMAGES),
        (IMAGE, "Image", "The image that you chose last"),
    ]


def alpha_property() -> Any:
    """An enum of everything, with pictures; its owner has `alpha_pixels`."""
    return EnumProperty(
        name="Alpha",
        description="A grey image as relief of the stroke: once of a dab, in a row along a stroke",
        items=lambda owner, _context: _items(
            getattr(owner, "alpha_pixels", ""), bpy.app.translations.locale
        ),
        default=0,
    )


def angle_property() -> Any:
    """By how much an alpha is turned, in radians."""
    return FloatProperty(
        name="Angle",
        description="The image is turned by it; at 0 its top points along the stroke",
        default=0.0,
        min=-math.pi,
        max=math.pi,
        subtype="ANGLE",
    )


def spacing_property() -> Any:
    """From one image of an alpha to the next."""
    return FloatProperty(
        name="Spacing",
        description="From one image to the next along the stroke, in radii; at 2 one begins where"
        " the one before it ends",
        default=NATURAL_SPACING,
        min=LEAST_SPACING,
        soft_min=0.5,
        soft_max=6.0,
        max=LARGEST_SPACING,
    )


def chosen_alpha(
    choice: str, pixels: str, angle: float = 0.0, spacing: float = NATURAL_SPACING
) -> Alpha | None:
    """What a choice means, with the image as text and the angle in radians.

    SculptError when there is no image yet.
    """
    if choice == NONE:
        return None
    degrees, spacing = round(math.degrees(angle), 3), round(spacing, 6)
    if choice != IMAGE:
        return Alpha(choice.lower(), angle=degrees, spacing=spacing)
    if (image := _image(pixels)) is None:
        raise SculptError(
            "No image was chosen for the alpha. Choose one in the panel Brush, or another alpha."
        )
    return Alpha(pixels=image.pixels, angle=degrees, spacing=spacing)


def unregister() -> None:
    """Forget pictures."""
    _items.cache_clear()


@lru_cache(maxsize=MOST_KEPT)
def _image(text: str) -> Alpha | None:
    """The artist's image, None when there is none or its text is damaged."""
    try:
        return Alpha.from_json({"pixels": text})
    except SculptError:
        return None


@lru_cache(maxsize=MOST_KEPT)
def _items(pixels: str, _locale: str) -> list[Item]:
    """Blender does not copy the texts of an item, so they outlive every menu that shows them."""
    items: list[Item] = []
    for number, (choice, name, tip) in enumerate(fixed_items()):
        icon, alpha = "X", None
        if choice == IMAGE:
            icon, alpha, number = "IMAGE_DATA", _image(pixels), IMAGE_NUMBER  # noqa: PLW2901
        elif choice != NONE:
            alpha = Alpha(choice.lower())
        if alpha is not None:
            icon = thumbnails.alpha_icon(alpha)
        items.append((choice, iface_(name), tip_(tip) if tip else "", icon, number))
    return items
