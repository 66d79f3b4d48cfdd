# SPDX-License-Identifier: GPL-3.0-or-later
"""Stroke files: `{"version": 1, "strokes": [...]}`, JSON in model space."""

import json
from collections.abc import Iterable, Mapping

from ..common.errors import SculptError
from .stroke import Stroke

VERSION = 1


def dump_strokes(strokes: Iterable[Stroke]) -> str:
    """The text of a stroke file."""
    document = {"version": VERSION, "strokes": [stroke.to_json() for stroke in strokes]}
    return json.dumps(document, allow_nan=False)


def parse_strokes(text: str) -> tuple[Stroke, ...]:
    """The strokes of a stroke file. SculptError when it is none, or of a newer version."""
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SculptError("This is no JSON stroke file ({}).", f"{error!s:.100}") from error
    if not isinstance(document, Mapping) or not isinstance(document.get("strokes"), list):
        raise SculptError('A stroke file is {"version": 1, "strokes": [...]}.')
    if (version := document.get("version")) != VERSION:
        raise SculptError(
            "This stroke file has version {}, this add-on reads version {}. Update Neural Sculpt,"
            " or save the strokes again with the version you have.",
            f"{version!r:.100}",
            VERSION,
        )
    strokes = []
    for number, data in enumerate(document["strokes"], 1):
        try:
            strokes.append(Stroke.from_json(data))
        except SculptError as error:
            raise SculptError("Stroke {}: {}", number, error) from error
    return tuple(strokes)
