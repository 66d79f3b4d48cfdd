# SPDX-License-Identifier: GPL-3.0-or-later
"""Every text that the artist sees can be translated, and is in German."""

import ast
import importlib.util
import inspect
import json
import tempfile
import unittest
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import bpy
from harness import EXTENSION, module

SHOWING = {"label", "operator", "operator_menu_enum", "prop", "row", "menu", "progress"}
"""Of a layout: calls whose `text` or `heading` is shown."""
SAYING = {"iface_", "tip_", "n_", "refuse", "fail"}
"""Calls whose texts are shown."""
FILLED = {"SculptError", "UnsuitableError", "Text"}
"""Calls in any room whose first text, filled by the others, is shown."""


def sources(room: str, but: str = "") -> Iterator[ast.AST]:
    """The code of a room, or of all, `but` for modules of that name."""
    spec = importlib.util.find_spec(f"{EXTENSION}{room}")
    assert spec is not None and spec.origin is not None
    for path in Path(spec.origin).parent.rglob("*.py"):
        if path.name != but:
            yield from ast.walk(ast.parse(path.read_text(encoding="utf-8")))


def text_of(node: ast.AST | None) -> str:
    """What a text says, with {} for what is filled in; empty for all else."""
    if isinstance(node, ast.JoinedStr):
        return "".join(text_of(part) or "{}" for part in node.values)
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    return ""


def name_of(call: ast.Call) -> str:
    """What is called, without what it is in."""
    return getattr(call.func, "attr", None) or getattr(call.func, "id", "")


def is_said(text: str) -> bool:
    """Whether there are words in a text."""
    return bool(text.strip("{}: \N{DEGREE SIGN}"))


def said() -> Iterator[str]:
    """Texts in the room that the artist sees: of layouts, reports and grey buttons."""
    for node in sources(".blender"):
        if isinstance(node, ast.Return) and text_of(node.value).endswith("."):
            yield text_of(node.value)  # a reason
        if not isinstance(node, ast.Call):
            continue
        name = name_of(node)
        texts = [k.value for k in node.keywords if k.arg in ("text", "heading")]
        if name in SAYING:
            texts = [*node.args]
        elif name not in SHOWING:
            continue
        yield from (text for node in texts if is_said(text := text_of(node)))


def templates() -> Iterator[str]:
    """Those of errors and other texts in all rooms; the command line speaks English alone."""
    calls = (node for node in sources("", but="cli.py") if isinstance(node, ast.Call))
    first = (node.args[0] for node in calls if name_of(node) in FILLED and node.args)
    yield from (template for node in first if is_said(template := text_of(node)))


def calls() -> Iterator[tuple[str, str, str | None]]:
    """Where a text is shown by a call, the text, and our context where the call names that."""
    for node in sources(".blender"):
        if not isinstance(node, ast.Call):
            continue
        name = name_of(node)
        given = {k.arg: k.value for k in node.keywords}
        text = node.args[0] if name == "iface_" else given.get("text")
        context = node.args[1] if name == "iface_" and node.args[1:] else given.get("text_ctxt")
        if name in {"iface_", *SHOWING}:
            named = isinstance(context, ast.Name) and context.id == "OURS"
            yield name, text_of(text), module("blender.locale.translations").OURS if named else None


def properties() -> Iterator[tuple[str, dict[str, Any]]]:
    """How all properties that are not hidden were defined."""
    for cls in module("blender.registration").CLASSES:
        for parent in cls.__mro__:
            for name, deferred in inspect.get_annotations(parent).items():
                given = getattr(deferred, "keywords", None)
                if given is not None and "HIDDEN" not in given.get("options", ()):
                    yield f"{cls.__name__}.{name}", given


def shown() -> Iterator[str]:
    """Labels and tooltips of everything that is registered."""
    for cls in module("blender.registration").CLASSES:
        yield getattr(cls, "bl_label", "")
        if issubclass(cls, bpy.types.Operator):
            yield cls.__doc__ or ""
    for _, given in properties():
        yield from (given.get("name", ""), given.get("description", ""))
        items = given.get("items", ())
        for item in items if isinstance(items, list) else ():
            yield from item[1:3]
    choices = module("blender.presets.shape_choices")
    for shape in (choices.Profile, choices.Modulation):
        for _, name, tip in choices.fixed_items(shape):
            yield from (name, tip)
        yield from (preset.name for preset in choices.loaded_presets(shape).values())
    for _, name, tip in module("blender.presets.alpha_choices").fixed_items():
        yield from (name, tip)


def texts() -> set[str]:
    """All texts but single letters and numbers."""
    every = (*said(), *templates(), *shown())
    return {text for text in every if len(text.strip()) > 1 and not text.isdigit()}


def german() -> dict[str, str]:
    """What each text is in German, wherever it stands."""
    table = module("blender.locale.translations").GERMAN
    return {text: said for (_, text), said in table.items()}


PO = """# a header
msgid ""
msgstr "Language: xx\\n"

# a comment of the translator
msgid "Box"
msgstr "Quader"

msgctxt "Message"
msgid ""
"A \\"quoted\\" text "
"over two lines."
msgstr ""
"Ein Text\\n"
"in zwei Zeilen, ä."
"""


class Translations(unittest.TestCase):
    maxDiff = None

    def test_a_po_file_is_read(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "xx.po"
            path.write_text(PO, encoding="utf-8")
            read = module("blender.locale.translations").read_po(path)
        sentence = 'A "quoted" text over two lines.'
        self.assertEqual(
            read,
            {("", "Box"): "Quader", ("Message", sentence): "Ein Text\nin zwei Zeilen, ä."},
        )

    def test_no_text_is_translated_twice(self) -> None:
        translations = module("blender.locale.translations")
        file = Path(translations.__file__).with_name("de.po")
        texts = [line for line in file.read_text("utf-8").splitlines() if line.startswith("msgid ")]
        self.assertEqual(len(texts) - 1, len(translations.GERMAN), "all but the header")

    def test_every_property_has_a_tooltip(self) -> None:
        silent = [name for name, given in properties() if not given.get("description")]
        self.assertEqual(silent, [])

    def test_every_text_is_in_german(self) -> None:
        self.assertEqual(sorted(texts() - set(german())), [])

    def test_words_of_another_sense_are_said_in_our_context(self) -> None:
        """Blender's own translation of a word goes before ours where the context is its own."""
        translations = module("blender.locale.translations")
        known = translations.GERMAN
        ours = {text for context, text in known if context == translations.OURS}
        ours -= {text for text in ours if ("", text) in known}  # which are said in both senses
        self.assertIn("Triangles", ours)
        said = []
        for name, given in properties():
            items = given.get("items")
            names = [given["name"], *(i[1] for i in (items if isinstance(items, list) else ()))]
            said += [(name, text, given.get("translation_context")) for text in names]
        for cls in module("blender.registration").CLASSES:
            context = getattr(cls, "bl_translation_context", None)
            said.append((cls.__name__, getattr(cls, "bl_label", ""), context))
        said += calls()
        for place, text, context in said:
            if text in ours:
                self.assertEqual(context, translations.OURS, f"{text} of {place}")

    def test_in_our_context_all_is_known(self) -> None:
        translations = module("blender.locale.translations")
        table = translations.in_contexts({("", "a"): "A", ("Neural Sculpt", "b"): "B"})
        known = {context: said for (context, text), said in table.items() if text == "a"}
        self.assertEqual(known, dict.fromkeys(("*", "Operator", "Neural Sculpt"), "A"))
        self.assertEqual([key for key in table if key[1] == "b"], [("Neural Sculpt", "b")])

    def test_what_is_filled_in_remains(self) -> None:
        for (_, text), said in module("blender.locale.translations").GERMAN.items():
            self.assertEqual(said.count("{}"), text.count("{}"), text)
            self.assertEqual(said.endswith("."), text.endswith("."), text)

    def test_nothing_is_translated_that_nobody_says(self) -> None:
        anywhere = {text_of(node) for node in sources("")} | texts()
        said = set(german())
        self.assertEqual(sorted(said - anywhere), [])

    def test_no_message_is_filled_before_it_is_looked_up(self) -> None:
        """A formatted string does not tell its template any more; `Text` and SculptError do."""
        table = module("blender.locale.translations").GERMAN
        messages = {text for context, text in table if context == "Message"}
        formatted = {text_of(node) for node in sources("") if isinstance(node, ast.JoinedStr)}
        undo_steps = {"Add {}"}  # whose names are no messages
        self.assertEqual(sorted(messages & formatted - undo_steps), [])

    def test_messages_that_were_put_together(self) -> None:
        translations, text = module("blender.locale.translations"), module("common.text").Text
        translated = translations.translated
        off = text("The stroke lies {} off the surface. Draw it on the proxy of this field.", 0.25)
        replayed = text("{}: {} Nothing was changed.", "Stroke 2", off)
        self.assertEqual(translated(replayed), replayed)
        self.enterContext(patch.object(translations, "rpt_", lambda text: german().get(text, text)))
        self.assertEqual(
            translated(replayed),
            "Stroke 2: Der Strich liegt 0.25 neben der Oberfläche. Auf den Proxy dieses Feldes"
            " zeichnen. Es wurde nichts geändert.",
        )
        self.assertEqual(translated(text("Fit {}", "Box")), "Box anpassen", "a name is no text")
        counted = text("Stroke {} of {}: {}", 3, 5, text("Sculpting"))
        self.assertEqual(translated(counted), "Strich 3 von 5: Modellieren")
        self.assertEqual(translated("Sculpting"), "Modellieren")
        self.assertEqual(translated("Grmbl."), "Grmbl.")

    def test_what_is_wrong_with_a_stroke_file(self) -> None:
        translations, errors = module("blender.locale.translations"), module("common.errors")
        self.enterContext(patch.object(translations, "rpt_", lambda text: german().get(text, text)))
        dab = {"points": [[0, 0, 0.5]], "radius": 0.1, "intensity": 0.1}
        wrong = (
            ({"radius": 5}, "Strich 2: Der Radius ist 5; er muss zwischen 0.001 und 1 liegen."),
            (
                {"profile": {"points": [[0, 0]]}},
                "Strich 2: Profil: Mindestens zwei Punkte sind nötig.",
            ),
        )
        for change, said in wrong:
            file = {"version": 1, "strokes": [dab, {**dab, **change}]}
            with self.assertRaises(errors.SculptError) as caught:
                module("stroke.file").parse_strokes(json.dumps(file))
            self.assertEqual(translations.translated(caught.exception.text), said)
