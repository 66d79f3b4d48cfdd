# SPDX-License-Identifier: GPL-3.0-or-later
"""The gallery inside Blender: meshes in the demo's studio, on no ground. Needs bpy."""

from pathlib import Path
from typing import Any, cast

import bpy
from bpy.types import Mesh
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
AROUND = (0.34, 0.35, 0.37, 1.0)  # even light, brighter than that of the demo's dark studio


def main(given: list[str]) -> None:
    """Write a picture beside each mesh."""
    for path in map(Path, given):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.ply_import(filepath=str(path))
        ob = bpy.context.active_object
        assert ob is not None
        cast(Mesh, ob.data).shade_smooth()
        studio.set_up(ob, Vector(SEEN_FROM.get(path.stem, OTHERS)).normalized())
        world = bpy.context.scene.world
        assert world is not None and world.node_tree is not None
        cast(Any, world.node_tree.nodes["Background"].inputs["Color"]).default_value = AROUND
        render = bpy.context.scene.render
        render.resolution_x, render.resolution_y = SIZE
        render.film_transparent = True
        render.image_settings.color_mode = "RGBA"
        studio.render(path.with_suffix(".png"))
