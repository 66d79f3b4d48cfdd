# SPDX-License-Identifier: GPL-3.0-or-later
"""The languages of the interface.

Blender translates labels, tooltips and the texts of layouts by itself; what is put together or
reported goes through `bpy.app.translations` where it is said. Texts in tables are marked by n_.
Messages, many of which come from the worker, arrive put together: `translated` knows them again.
"""

import re

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from . import ADDON
from .german import TEXTS
from .german_messages import MESSAGES

GERMAN = TEXTS | MESSAGES

CONTEXTS = ("*", "Operator")
"""Blender looks up the names of operators apart from all else."""
LANGUAGES = {"de": GERMAN, "de_DE": GERMAN}
"""By locale; which of the two is German's depends on the Blender."""
_PATTERNS = [
    (text, re.compile(re.escape(text).replace(r"\{\}", "(.+)"), re.DOTALL))
    for text in sorted(MESSAGES, key=len, reverse=True)  # the one that leaves least to fill in
]


def translated(message: str) -> str:
    """A message in the artist's language; what was filled in is kept, but for messages in it."""
    return _put_together(message) or rpt_(message)


def _put_together(message: str) -> str:
    """Empty when it is none of the messages."""
    for text, pattern in _PATTERNS:
        if (found := pattern.fullmatch(message)) is not None:
            return rpt_(text).format(*(_put_together(part) or part for part in found.groups()))
    return ""


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
