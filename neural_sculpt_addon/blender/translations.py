# SPDX-License-Identifier: GPL-3.0-or-later
"""The languages of the interface.

Blender translates labels, tooltips and the texts of layouts by itself; what is put together or
reported goes through `bpy.app.translations` where it is said. Texts in tables are marked by n_.
"""

import bpy

from . import ADDON
from .german import TEXTS as GERMAN

CONTEXTS = ("*", "Operator")
"""Blender looks up the names of operators apart from all else."""
LANGUAGES = {"de": GERMAN, "de_DE": GERMAN}
"""By locale; which of the two is German's depends on the Blender."""


def register() -> None:
    """Add the languages."""
    table = {
        locale: {(context, text): said for context in CONTEXTS for text, said in texts.items()}
        for locale, texts in LANGUAGES.items()
    }
    bpy.app.translations.register(ADDON, table)


def unregister() -> None:
    """Remove them."""
    bpy.app.translations.unregister(ADDON)
