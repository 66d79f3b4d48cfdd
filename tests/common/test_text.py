# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts: what they say, what they remember, and the way through JSON and back."""

import ast
import json
from pathlib import Path

import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.common.text import MOST_DEPTH, Text, fill, from_json, to_json

ROOT = Path(__file__).parents[2]
KEEPING = {"SculptError", "UnsuitableError", "Text"}
"""Calls that keep the template and what fills it."""

OFF = SculptError("The stroke lies {} off the surface. Draw it on the proxy.", f"{0.251:.2f}")
NESTED = Text("{}: {} Nothing was changed.", "Stroke 2", OFF)


def test_a_text_reads_as_a_string() -> None:
    assert NESTED == (
        "Stroke 2: The stroke lies 0.25 off the surface. Draw it on the proxy. Nothing was changed."
    )
    assert str(OFF) == OFF.text == "The stroke lies 0.25 off the surface. Draw it on the proxy."
    assert Text("{} of {}", 3, None) == "3 of None"


def test_a_text_remembers_what_it_was_made_of() -> None:
    assert NESTED.template == "{}: {} Nothing was changed."
    name, within = NESTED.arguments
    assert not isinstance(name, Text)
    assert isinstance(within, Text) and within.arguments == ("0.25",)
    assert Text(NESTED) is NESTED
    assert SculptError(NESTED).text is NESTED


def test_what_fills_a_template_is_no_template() -> None:
    assert Text("{} and {}", "{}", "b") == "{} and b"
    assert Text("A file is {}, {'version': 1}.") == "A file is {}, {'version': 1}."


@pytest.mark.parametrize(("template", "arguments"), [("{}", "ab"), ("{} {}", "a"), ("", "a")])
def test_arguments_are_as_many_as_places(template: str, arguments: str) -> None:
    with pytest.raises(ValueError, match="does not take"):
        fill(template, tuple(arguments))


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("Meshing", "Meshing"),
        (Text("{} left", 3), ["{} left", "3"]),
        (Text("{}: {}", "a", Text("Meshing")), ["{}: {}", "a", ["Meshing"]]),
        (NESTED, [NESTED.template, "Stroke 2", [OFF.text.template, "0.25"]]),
    ],
)
def test_json_and_back(text: str, written: object) -> None:
    assert to_json(text) == written
    read = from_json(json.loads(json.dumps(written)))
    assert read == text and to_json(read) == written


def test_json_of_others_is_bounded() -> None:
    deep: object = "end"
    for _ in range(MOST_DEPTH):
        deep = ["{}", deep]
    assert from_json(deep) == "end"
    for wrong in (["{}", deep], [], [3], ["{}", 3], ["{}", None], ["{}"] * 3, {}, None, 3, [["a"]]):
        with pytest.raises(ValueError):
            from_json(wrong)


def test_no_error_is_put_together_before_it_is_looked_up() -> None:
    """A formatted string does not tell its template any more."""
    wrong = []
    for path in (ROOT / "neural_sculpt_addon").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            parts = [*map(ast.walk, node.args[:1])] if name in KEEPING else []
            if any(isinstance(part, ast.JoinedStr) for nodes in parts for part in nodes):
                wrong.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert wrong == []
