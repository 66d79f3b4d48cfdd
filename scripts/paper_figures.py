# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 1, 2 and 4 of the paper with our own strokes: python3 scripts/paper_figures.py.

Families of profiles, modulations, radii and intensities, each stroke on an unedited shape. The
strokes are those of paper/figures/strokes.json, in model space. Pictures go to
test-output/figures/, beside each the stroke files of its cells, for `python -m neural_sculpt_addon
apply`. Shapes whose network is not there, as those of ../shared/data, are left out.
`scripts/paper.py` has those of the sphere in its page.

    1 2 4              only these figures
    --shape suzanne    only this shape
"""

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from paper.figures.strokes import cells, read, shape_of
from workshop import ROOT, environment

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

TARGET = ROOT / "test-output" / "figures"
SIZE = 280


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


def draw(source: dict[str, Any], figure: str, shape: str) -> Iterator[str]:
    """Make one figure of one shape; a line for each stroke, and one for the picture."""
    from pictures import sheet

    from neural_sculpt_addon.stroke.file import dump_strokes

    if shape_of(network := source["shapes"][shape]["network"]) is None:
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
    path = folder.with_suffix(".png")
    sheet.save(path, sheet.below([sheet.beside(row) for row in rows.values()]))
    yield str(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
