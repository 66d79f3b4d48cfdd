# SPDX-License-Identifier: GPL-3.0-or-later
"""The languages of the interface, each a PO file beside this module.

Blender translates labels, tooltips and the texts of layouts by itself; what is put together or
reported goes through `bpy.app.translations` where it is said. Texts in tables are marked by n_.
What was put together, as messages of the worker are, goes through `translated`, which looks up the
template of the text.
"""

import json
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ...common.text import Text, fill
from .. import ADDON


def read_po(path: Path) -> dict[tuple[str, str], str]:
    """The translations in a PO file, by context and text. Its entries are separated by blank
    lines."""
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
"""Context in a PO file of what is told while or after something happens, with {} where a message is
filled (see `Text`)."""

OURS = "Neural Sculpt"
"""Context of words that mean something else in Blender, whose own translation of a word takes
precedence over an add-on's. Every text is translated in this context, too, so a class with one such
word can use it for all of its texts."""

GERMAN = read_po(Path(__file__).with_name("de.po"))

CONTEXTS = ("*", "Operator")
"""Blender looks up the names of operators apart from all else."""
LANGUAGES = {"de": GERMAN, "de_DE": GERMAN}
"""By locale. German is the first or the second, depending on Blender's version."""


def translated(message: str) -> str:
    """A message in the artist's language. What fills its template stays as it is, unless it is a
    text itself."""
    text = Text(message)
    said = (translated(each) if isinstance(each, Text) else each for each in text.arguments)
    return fill(rpt_(text.template), tuple(said))


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
