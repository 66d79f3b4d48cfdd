# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 1, 2 and 4 of the paper with our own strokes: python3 scripts/paper_figures.py.

Families of profiles, modulations, radii and intensities, each stroke on an unedited shape. The
strokes are those of paper_figures.json, in model space. Pictures go to test-output/figures/, beside
each the stroke files of its cells, for `python -m neural_sculpt_addon apply`. Shapes whose network
is not there, as those of ../shared/data, are left out. `scripts/paper.py` has those of the sphere
in its page.

    1 2 4              only these figures
    --shape suzanne    only this shape
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import environment
from environment import ROOT

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from neural_sculpt_addon.stroke.stroke import Stroke

SOURCE = Path(__file__).with_suffix(".json")
TARGET = ROOT / "test-output" / "figures"
SIZE = 280


class Cell(NamedTuple):
    """One stroke of a family, and the picture of what it made."""

    family: str
    name: str
    stroke: "Stroke"
    picture: "NDArray[np.uint8]"
    report: dict[str, Any]


def main() -> None:
    """Make the figures that the command line names."""
    source = read()
    parser = argparse.ArgumentParser(description="The paper's figures 1, 2 and 4.")
    parser.add_argument("figures", nargs="*", choices=[*source["figures"], []])
    parser.add_argument("--shape", choices=source["shapes"])
    options = parser.parse_args()
    environment.enter("worker")
    for figure in options.figures or source["figures"]:
        for shape in [options.shape] if options.shape else source["shapes"]:
            for line in draw(source, figure, shape):
                print(line, flush=True)


def read() -> dict[str, Any]:
    """Shapes and families of strokes."""
    return json.loads(SOURCE.read_text(encoding="utf-8"))


def draw(source: dict[str, Any], figure: str, shape: str) -> Iterator[str]:
    """Make one figure of one shape; a line for each stroke, and one for the picture."""
    from paper import sheet

    from neural_sculpt_addon.stroke.file import dump_strokes

    if _field(network := source["shapes"][shape]["network"]) is None:
        yield f"figure {figure}, {shape}: left out, there is no {network}"
        return
    folder = TARGET / f"figure-{figure}-{shape}"
    folder.mkdir(parents=True, exist_ok=True)
    rows: dict[str, list[NDArray[np.uint8]]] = {}
    for cell in cells(source, figure, shape, SIZE):
        path = folder / f"{cell.name.replace(' ', '-')}.json"
        path.write_text(dump_strokes([cell.stroke]), encoding="utf-8")
        labelled = sheet.below([cell.picture, sheet.label(cell.name, SIZE)])
        rows.setdefault(cell.family, []).append(labelled)
        yield (
            f"figure {figure}, {shape}, {cell.family} {cell.name}: "
            f"tube p95 {cell.report['tube_p95']:.4f}, drift {cell.report['drift_mean']:.5f}"
        )
    path = folder.with_suffix(".jpg")
    sheet.save(path, sheet.below([sheet.beside(row) for row in rows.values()]))
    yield str(path.relative_to(ROOT))


def cells(source: dict[str, Any], figure: str, shape: str, size: int) -> Iterator[Cell]:
    """Sculpt and draw all strokes of a figure, whose shape is there; `size` in pixels."""
    import field_picture

    from neural_sculpt_addon.field.edit.edit import edit
    from neural_sculpt_addon.stroke.file import parse_strokes

    about = source["shapes"][shape]
    field, camera = _field(about["network"]), field_picture.Camera(**about["camera"])
    for family in source["figures"][figure]:
        for name, changes in family["cells"].items():
            data = {"points": about["points"], **source["brush"], **changes, "name": name}
            strokes = parse_strokes(json.dumps({"version": 1, "strokes": [data]}))
            edited, (report,) = edit(field, strokes)
            drawn = field_picture.picture(edited, camera, size, field_picture.EVEN_LIGHT)
            yield Cell(family["title"], name, strokes[0], drawn, report)


def _field(name: str) -> Any:
    """A primitive, or the field in a file; None when there is no such file."""
    from neural_sculpt_addon.field import checkpoint, primitives

    if name in primitives.PRIMITIVES:
        return primitives.primitive(name)
    path = ROOT / name
    return checkpoint.load(path) if path.exists() else None


if __name__ == "__main__":
    main()
