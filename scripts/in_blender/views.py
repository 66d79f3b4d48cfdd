# SPDX-License-Identifier: GPL-3.0-or-later
"""Views of meshes for figures: the demo's studio, without perspective, on no ground. Needs bpy.

python scripts/in_blender/start.py in_blender.views '{"half": 0.7, "size": 420}' MESH.ply ...

The camera looks along +Y at the origin.
"""

import json
from pathlib import Path
from typing import cast

from bpy.types import Camera
from mathutils import Vector

from . import studio

AWAY = 4.0  # of the camera, model units


def main(given: list[str]) -> None:
    """Write a picture beside each mesh."""
    view, *meshes = given
    about = json.loads(view)
    for path in map(Path, meshes):
        camera = studio.set_up(studio.read(path), Vector((0.0, -1.0, 0.0)))
        lens = cast(Camera, camera.data)
        lens.type, lens.ortho_scale = "ORTHO", 2 * about["half"]
        camera.location = (0.0, -AWAY, 0.0)
        studio.on_nothing((about["size"], about["size"]))
        studio.render(path.with_suffix(".png"))
