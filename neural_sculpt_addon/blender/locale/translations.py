# SPDX-License-Identifier: GPL-3.0-or-later
"""The languages of the interface, each a PO file beside this module.

Blender translates labels, tooltips and the texts of layouts by itself; what is put together or
reported goes through `bpy.app.translations` where it is said. Texts in tables are marked by n_.
Messages, many of which come from the worker, arrive put together: `translated` knows them again.
"""

import json
import re
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from .. import ADDON


def read_po(path: Path) -> dict[tuple[str, str], str]:
    """The translations in a PO file by context and text; blank lines part its entries."""
    entries: dict[tuple[str, str], str] = {}
    for block in path.read_text(encoding="utf-8").split("\n\n"):
        entry = {"msgctxt": "", "msgid": "", "msgstr": ""}
        word = ""
        for line in block.splitlines():
            if line.startswith("#"):
                continue
            if not line.startswith('"'):
                word, line = line.split(" ", 1)  # noqa: PLW2901 - the first part of a text
            entry[word] += json.loads(line)
        if entry["msgid"]:  # the one without is the file's header
            entries[entry["msgctxt"], entry["msgid"]] = entry["msgstr"]
    return entries


MESSAGE = "Message"
"""Context in a PO file of what is told while or after something happens. A message may have been
put together, each {} from something else."""

OURS = "Neural Sculpt"
"""Context of words that mean something else elsewhere: Blender's own translation of a word goes
before an add-on's. Every text is known in it, so a class that has one such word can use it for all
of its texts."""

GERMAN = read_po(Path(__file__).with_name("de.po"))

CONTEXTS = ("*", "Operator")
"""Blender looks up the names of operators apart from all else."""
LANGUAGES = {"de": GERMAN, "de_DE": GERMAN}
"""By locale; which of the two is German's depends on the Blender."""
_MESSAGES = [text for context, text in GERMAN if context == MESSAGE]
_PATTERNS = [
    (text, re.compile(re.escape(text).replace(r"\{\}", "(.+)"), re.DOTALL))
    for text in sorted(_MESSAGES, key=len, reverse=True)  # the one that leaves least to fill in
]


def translated(message: str) -> str:
    """A message in the artist's language; what was filled in stays, but for messages in it."""
    return _put_together(message) or rpt_(message)


def _put_together(message: str) -> str:
    """The translation with what was filled in; empty when no message has this form."""
    for text, pattern in _PATTERNS:
        if (found := pattern.fullmatch(message)) is not None:
            return rpt_(text).format(*(_put_together(part) or part for part in found.groups()))
    return ""


def register() -> None:
    """Add the languages."""
    table = {locale: in_contexts(texts) for locale, texts in LANGUAGES.items()}
    bpy.app.translations.register(ADDON, table)


def in_contexts(texts: dict[tuple[str, str], str]) -> dict[tuple[str, str], str]:
    """The translations by each context in which Blender looks for them."""
    own = {(OURS, text): said for (given, text), said in texts.items() if given == OURS}
    everywhere = {
        (context, text): said
        for (given, text), said in texts.items()
        for context in (*CONTEXTS, OURS)
        if given != OURS
    }
    return everywhere | own


def unregister() -> None:
    """Remove them."""
    bpy.app.translations.unregister(ADDON)
