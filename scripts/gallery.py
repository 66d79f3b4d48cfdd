# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt and render the stroke files of examples/: python3 scripts/gallery.py [NAME ...].

Writes docs/paper/gallery.png. Meshes are kept in test-output/gallery/ and made again when their
stroke file is newer.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import make_examples
from in_blender import START
from workshop import ROOT, environment

FOLDER = ROOT / "test-output" / "gallery"
TARGET = ROOT / "docs" / "paper" / "gallery.png"
SHOWN = "ring", "pumpkin", "scales", "inscription", "robot", "hair"
CELLS = 256  # of the meshes that are rendered
COLUMNS = 3


def main() -> None:
    """Make the picture, or only the meshes and renderings of the examples that are named."""
    parser = argparse.ArgumentParser(description="Sculpt and render the stroke files of examples/.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(make_examples.EXAMPLES))
    names = parser.parse_args().names
    if unknown := set(names) - set(make_examples.EXAMPLES):
        sys.exit(f"There is no example {', '.join(sorted(unknown))}.")
    environment.enter("worker")
    FOLDER.mkdir(parents=True, exist_ok=True)
    meshes = [_mesh(name) for name in names or SHOWN]
    command = [str(environment.ensure().blender), str(START), "in_blender.gallery"]
    subprocess.run([*command, *map(str, meshes)], check=True)
    if not names:
        _join([mesh.with_suffix(".png") for mesh in meshes])


def _mesh(name: str) -> Path:
    """The mesh of the example after all of its strokes."""
    from neural_sculpt_addon.field.edit.edit import sculpt
    from neural_sculpt_addon.field.mesh import mesh_file
    from neural_sculpt_addon.field.mesh.proxy import extract
    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.field.problem.prepare import prepare
    from neural_sculpt_addon.stroke.file import parse_strokes

    strokes, mesh = make_examples.FOLDER / f"{name}.json", FOLDER / f"{name}.ply"
    if mesh.is_file() and mesh.stat().st_mtime > strokes.stat().st_mtime:
        return mesh
    now = prepare(primitive(make_examples.EXAMPLES[name].field))
    for stroke in parse_strokes(strokes.read_text(encoding="utf-8")):
        edit = sculpt(now, stroke)
        print(f"{name}, {stroke.name}: {edit.seconds:.1f} s", flush=True)
        now = edit.preparation
    mesh_file.write(mesh, extract(now.field, CELLS))
    return mesh


def _join(paths: list[Path]) -> None:
    """All renderings as one picture."""
    import numpy as np
    from pictures import sheet
    from PIL import Image

    cells = [Image.open(path) for path in paths]
    width, height = cells[0].size
    rows = -(-len(cells) // COLUMNS)
    page = Image.new("RGB", (width * COLUMNS, height * rows), "white")
    for place, cell in enumerate(cells):
        page.paste(cell, (width * (place % COLUMNS), height * (place // COLUMNS)), cell)
    TARGET.parent.mkdir(parents=True, exist_ok=True)
    sheet.save(TARGET, np.asarray(page))
    print(TARGET.relative_to(ROOT))


if __name__ == "__main__":
    main()
