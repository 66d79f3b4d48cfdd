# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of our own for the paper's figures 1, 2 and 4: profiles, modulations, radii, intensities.

Each is on an unedited shape; strokes.json has them, in model space.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from workshop import ROOT

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from neural_sculpt_addon.stroke.stroke import Stroke

SOURCE = Path(__file__).with_suffix(".json")


class Cell(NamedTuple):
    """One stroke of a family, and the picture of what it made."""

    family: str
    name: str
    stroke: "Stroke"
    picture: "NDArray[np.uint8]"
    report: dict[str, Any]


def read() -> dict[str, Any]:
    """Shapes and families of strokes."""
    return json.loads(SOURCE.read_text(encoding="utf-8"))


def cells(source: dict[str, Any], figure: str, shape: str, size: int) -> Iterator[Cell]:
    """Sculpt and draw all strokes of a figure, whose shape is there; `size` in pixels."""
    from pictures import field_picture, rendered

    from neural_sculpt_addon.field.edit.edit import edit
    from neural_sculpt_addon.stroke.file import parse_strokes

    about = source["shapes"][shape]
    field, camera = shape_of(about["network"]), field_picture.Camera(**about["camera"])
    made, fields = [], []
    for family in source["figures"][figure]:
        for name, changes in family["cells"].items():
            data = {"points": about["points"], **source["brush"], **changes, "name": name}
            strokes = parse_strokes(json.dumps({"version": 1, "strokes": [data]}))
            edited, (report,) = edit(field, strokes)
            made.append((family["title"], name, strokes[0], report))
            fields.append(edited)
    drawn = rendered.pictures(fields, camera, size)
    for (title, name, stroke, report), picture in zip(made, drawn, strict=True):
        yield Cell(title, name, stroke, picture, report)


def shape_of(name: str) -> Any:
    """A primitive, or the field in a file; None when there is no such file."""
    from neural_sculpt_addon.field import checkpoint, primitives

    if name in primitives.PRIMITIVES:
        return primitives.primitive(name)
    path = ROOT / name
    return checkpoint.load(path) if path.exists() else None
