# SPDX-License-Identifier: GPL-3.0-or-later
"""Every text that the artist sees can be translated, and is in German."""

import ast
import importlib.util
import inspect
import unittest
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
from harness import EXTENSION, module

SHOWING = {"label", "operator", "operator_menu_enum", "prop", "row", "menu", "progress"}
"""Of a layout: calls whose `text` or `heading` is shown."""
SAYING = {"iface_", "tip_", "n_", "refuse", "fail", "SculptError"}
"""Calls whose texts are shown."""


def sources() -> Iterator[Path]:
    """The files of the room that the artist sees."""
    spec = importlib.util.find_spec(f"{EXTENSION}.blender")
    assert spec is not None and spec.origin is not None
    yield from Path(spec.origin).parent.rglob("*.py")


def said() -> Iterator[str]:
    """Texts in the code: of layouts, reports and grey buttons."""
    for path in sources():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, "attr", None) or getattr(node.func, "id", "")
            texts = [k.value for k in node.keywords if k.arg in ("text", "heading")]
            if name in SAYING:
                texts = [*node.args]
            elif name not in SHOWING:
                continue
            for text in texts:
                if isinstance(text, ast.Constant) and isinstance(text.value, str):
                    yield text.value


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
            yield cls.__doc__
    for _, given in properties():
        yield from (given.get("name", ""), given.get("description", ""))
        items = given.get("items", ())
        for item in items if isinstance(items, list) else ():
            yield from item[1:3]
    choices = module("blender.shape_choices")
    for shape in (choices.Profile, choices.Modulation):
        for _, name, tip in choices.fixed_items(shape):
            yield from (name, tip)
        yield from (preset.name for preset in choices._presets(shape).values())


def texts() -> set[str]:
    """All texts but single letters and numbers."""
    return {text for text in (*said(), *shown()) if len(text.strip()) > 1 and not text.isdigit()}


class Translations(unittest.TestCase):
    def test_every_property_has_a_tooltip(self) -> None:
        silent = [name for name, given in properties() if not given.get("description")]
        self.assertEqual(silent, [])

    def test_every_text_is_in_german(self) -> None:
        german = module("blender.german").TEXTS
        self.assertEqual(sorted(texts() - set(german)), [])

    def test_what_is_filled_in_remains(self) -> None:
        for text, said in module("blender.german").TEXTS.items():
            self.assertEqual(said.count("{}"), text.count("{}"), text)
            self.assertEqual(said.endswith("."), text.endswith("."), text)

    def test_nothing_is_translated_that_nobody_says(self) -> None:
        progress = {"Measuring", "Meshing", "Preparing", "Refining", "Sculpting"}
        self.assertEqual(sorted(set(module("blender.german").TEXTS) - texts() - progress), [])
