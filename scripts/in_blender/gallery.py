# SPDX-License-Identifier: GPL-3.0-or-later
"""The gallery inside Blender: meshes in the demo's studio, on no ground. Needs bpy."""

from pathlib import Path

from mathutils import Vector

from . import studio

SIZE = (480, 400)
SEEN_FROM = {  # by the names of the files
    "ring": (0.1, -1.0, 0.75),
    "scales": (0.2, -0.75, 1.0),
    "hair": (0.6, -1.0, 0.75),
    "robot": (0.3, -1.0, 0.15),
}
OTHERS = (0.2, -1.0, 0.28)


def main(given: list[str]) -> None:
    """Write a picture beside each mesh."""
    for path in map(Path, given):
        seen_from = Vector(SEEN_FROM.get(path.stem, OTHERS)).normalized()
        studio.set_up(studio.read(path), seen_from)
        studio.on_nothing(SIZE)
        studio.render(path.with_suffix(".png"))
