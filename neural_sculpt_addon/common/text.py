# SPDX-License-Identifier: GPL-3.0-or-later
"""Text for the artist: a template and what fills it, so that whoever shows the text looks up the
translation of the template, wherever it comes from.

To all that only writes it down it is a `str`, put together. In JSON, between processes and in
reports, it is a list, `["The stroke lies {} off the surface.", "0.25"]`, or its template alone
where nothing fills that. What fills a template is a string, shown as it is, or a text again.
"""

from typing import Any

MOST_DEPTH = 8
"""Texts within texts that are read from JSON: those of this package are at most four deep."""


class Text(str):
    """`Text(template, *arguments)`: each {} of the template is filled by an argument."""

    __slots__ = ("arguments", "template")

    template: str
    arguments: tuple[str, ...]

    def __new__(cls, template: str, *arguments: object) -> "Text":
        """A text, or an error that has one, stays a text within this one; all else is written out.

        ValueError when there are arguments, and not as many as {}.
        """
        if isinstance(template, Text) and not arguments:
            return template
        given = tuple(map(_argument, arguments))
        text = super().__new__(cls, fill(template, given))
        text.template, text.arguments = template, given
        return text


def fill(template: str, arguments: tuple[str, ...]) -> str:
    """A template with its {} filled, or as it is when there are no arguments. ValueError when there
    are, and not as many as {}."""
    if not arguments:
        return template
    first, *parts = template.split("{}")
    if len(parts) != len(arguments):
        raise ValueError(f"{template!r:.100} does not take {len(arguments)} arguments")
    return first + "".join(a + b for a, b in zip(arguments, parts, strict=True))


def to_json(text: str) -> str | list[Any]:
    """A text as JSON."""
    text = Text(text)
    if not text.arguments:
        return text.template
    return [text.template, *(_nested(each) for each in text.arguments)]


def from_json(value: object) -> Text:
    """The text that JSON holds. ValueError when it holds none, or one too deep."""
    return Text(value) if isinstance(value, str) else _read(value, MOST_DEPTH)


def _argument(value: object) -> str:
    text = getattr(value, "text", value)
    return text if isinstance(text, str) else str(value)


def _nested(argument: str) -> str | list[Any]:
    """In a list: to be told from a string that is shown as it is."""
    if not isinstance(argument, Text):
        return argument
    return [argument.template, *map(_nested, argument.arguments)]


def _read(value: object, depth: int) -> Text:
    if not isinstance(value, list) or depth == 0:
        raise ValueError("a text is a list of a template and what fills it, not too deep")
    template, *given = value or [None]
    if not isinstance(template, str):
        raise ValueError("the template of a text is a string")
    read = (each if isinstance(each, str) else _read(each, depth - 1) for each in given)
    return Text(template, *read)
