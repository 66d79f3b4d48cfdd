# SPDX-License-Identifier: GPL-3.0-or-later
"""A field that is not there yet, drawn over the scene.

It is that of a running fit, over the mesh that is fitted, or the result of a Boolean whose dialog
is open, over the two solids. Nothing of it is in the scene, in undo steps or in files.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix
from numpy.typing import NDArray

from ...interaction.ribbon import LIFT
from ...worker.client import Message
from .. import preferences, redraw
from .draw_handler import DrawHandler

LIGHT = np.array([0.3, -0.5, 0.81])
"""Where the light comes from, in the world; a unit vector."""
DARKEST = 0.25


@dataclass(frozen=True)
class _Shown:
    holds: Callable[[], bool]  # whether it is still to be seen
    on_top: bool  # of all that is in the scene
    points: NDArray[np.float32]  # (V, 3), world
    colors: NDArray[np.float32]  # (V, 4)
    triangles: NDArray[np.int32]  # (F, 3)


class _State:
    shown: _Shown | None = None


def show(preview: Message, matrix: Matrix, holds: Callable[[], bool], on_top: bool = False) -> None:
    """Show a mesh of a field, for as long as `holds` says so.

    matrix: from the field's model space to the world
    on_top: whether it is drawn over what would hide it
    """
    arrays = preview.arrays
    turn, shift = np.array(matrix.to_3x3()), np.array(matrix.translation)  # (3, 3), (3,)
    points = (arrays["vertices"] + LIFT * arrays["normals"]) @ turn.T + shift
    towards = arrays["normals"] @ np.array(matrix.to_quaternion().to_matrix()).T @ LIGHT  # (V,)
    color = np.tile(preferences.overlay_colors().raising, (len(points), 1))
    color[:, :3] *= DARKEST + (1 - DARKEST) * (towards[:, None] + 1) / 2
    color[:, 3] = 1
    _State.shown = _Shown(
        holds, on_top, points.astype(np.float32), color.astype(np.float32), arrays["triangles"]
    )
    redraw.tag_views()


def keep(holds: Callable[[], bool]) -> None:
    """Show what is shown as long as another condition holds."""
    if _State.shown is not None:
        _State.shown = replace(_State.shown, holds=holds)


def _draw() -> None:
    """Draw in the scene, in world space."""
    shown = _State.shown
    if shown is None:
        return
    if not shown.holds():
        _State.shown = None
        return
    triangles = shown.triangles
    if shown.on_top:
        triangles = triangles[np.argsort(-_depth(shown.points)[triangles].mean(axis=1))]
        gpu.state.face_culling_set("BACK")
    else:
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    data = {"pos": shown.points, "color": shown.colors}
    batch_for_shader(shader, "TRIS", data, indices=triangles).draw(shader)  # pyright: ignore[reportArgumentType]
    gpu.state.face_culling_set("NONE")
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _depth(points: NDArray[np.float32]) -> NDArray[np.float64]:
    """Depths (V,) of points (V, 3) of the world, as seen in the viewport that is drawn."""
    matrix = np.array(bpy.context.region_data.view_matrix)
    return -(points @ matrix[2, :3])


_handler = DrawHandler(_draw)


def register() -> None:
    """Let Blender call us whenever it draws."""
    _handler.add()


def unregister() -> None:
    """Draw no more."""
    _State.shown = None
    _handler.remove()
