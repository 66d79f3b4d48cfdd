# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 1, 2 and 4 of the paper with our own strokes: python3 scripts/paper_figures.py.

Families of profiles, modulations, radii and intensities, each stroke on an unedited shape. The
strokes are those of paper_figures.json, in model space. Pictures go to test-output/figures/, beside
each the stroke files of its cells, for `python -m neural_sculpt_addon apply`. Shapes whose network
is not there, as those of ../shared/data, are left out.

    1 2 4              only these figures
    --shape suzanne    only this shape
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import environment
from environment import ROOT

SOURCE = Path(__file__).with_suffix(".json")
TARGET = ROOT / "test-output" / "figures"
SIZE = 240
LABEL = 22


def main() -> None:
    """Make the figures that the command line names."""
    source = json.loads(SOURCE.read_text(encoding="utf-8"))
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
    import field_picture
    import numpy as np
    from PIL import Image

    from neural_sculpt_addon.field.edit.edit import edit
    from neural_sculpt_addon.stroke.file import dump_strokes, parse_strokes

    about = source["shapes"][shape]
    if (field := _field(about["network"])) is None:
        yield f"figure {figure}, {shape}: left out, there is no {about['network']}"
        return
    camera = field_picture.Camera(**about["camera"])
    folder = TARGET / f"figure-{figure}-{shape}"
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for family in source["figures"][figure]:
        cells = []
        for name, changes in family["cells"].items():
            stroke = {"points": about["points"], **source["brush"], **changes, "name": name}
            text = json.dumps({"version": 1, "strokes": [stroke]})
            strokes = parse_strokes(text)
            (folder / f"{name.replace(' ', '-')}.json").write_text(dump_strokes(strokes))
            edited, (report,) = edit(field, strokes)
            cells.append(_labelled(field_picture.picture(edited, camera, SIZE), name))
            yield (
                f"figure {figure}, {shape}, {family['title']} {name}: "
                f"tube p95 {report['tube_p95']:.4f}, drift {report['drift_mean']:.5f}"
            )
        rows.append(np.concatenate(cells, 1))
    width = max(row.shape[1] for row in rows)
    rows = [np.pad(r, ((0, 0), (0, width - r.shape[1]), (0, 0)), constant_values=255) for r in rows]
    path = folder.with_suffix(".png")
    Image.fromarray(np.concatenate(rows)).save(path)
    yield str(path.relative_to(ROOT))


def _field(name: str) -> Any:
    """A primitive, or the field in a file; None when there is no such file."""
    from neural_sculpt_addon.field import checkpoint, primitives

    if name in primitives.PRIMITIVES:
        return primitives.primitive(name)
    path = ROOT / name
    return checkpoint.load(path) if path.exists() else None


def _labelled(picture: Any, text: str) -> Any:
    """The picture with its name below."""
    import numpy as np
    from PIL import Image, ImageDraw

    size = picture.shape[0]
    page = Image.new("RGB", (size, size + LABEL), "white")
    page.paste(Image.fromarray(picture))
    ImageDraw.Draw(page).text((size / 2, size + LABEL / 2), text, "black", anchor="mm")
    return np.asarray(page)


if __name__ == "__main__":
    main()
