# SPDX-License-Identifier: GPL-3.0-or-later
"""The field of a running fit, drawn over the mesh that it learns and sharpening with it.

Nothing of it is in the scene: it goes when its job ends, and neither undo nor files know of it.
"""

# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

from dataclasses import dataclass

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix
from numpy.typing import NDArray

from ...worker.client import Message
from .. import preferences, redraw
from ..session.job import Job
from ..session.worker_session import session
from .draw_handler import DrawHandler

LIGHT = np.array([0.3, -0.5, 0.81])
"""Where the light comes from, in the world; a unit vector."""
DARKEST = 0.25
LIFT = 0.004
"""Model units by which the field is drawn outside of itself, so that the mesh does not hide it."""


@dataclass(frozen=True)
class _Shown:
    job: Job
    points: NDArray[np.float32]  # (V, 3), world
    colors: NDArray[np.float32]  # (V, 4)
    triangles: NDArray[np.int32]  # (F, 3)


class _State:
    shown: _Shown | None = None


def show(job: Job, preview: Message, matrix: Matrix) -> None:
    """Show a preview of the field that `job` fits; its model space is at `matrix` in the world."""
    arrays = preview.arrays
    turn, shift = np.array(matrix.to_3x3()), np.array(matrix.translation)  # (3, 3), (3,)
    points = (arrays["vertices"] + LIFT * arrays["normals"]) @ turn.T + shift
    towards = arrays["normals"] @ np.array(matrix.to_quaternion().to_matrix()).T @ LIGHT  # (V,)
    color = np.tile(preferences.overlay_colors().raising, (len(points), 1))
    color[:, :3] *= DARKEST + (1 - DARKEST) * (towards[:, None] + 1) / 2
    color[:, 3] = 1
    _State.shown = _Shown(
        job, points.astype(np.float32), color.astype(np.float32), arrays["triangles"]
    )
    redraw.tag_views()


def _draw() -> None:
    """In the scene, in world space."""
    shown = _State.shown
    if shown is None:
        return
    if shown.job not in session.jobs:
        _State.shown = None
        return
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    data = {"pos": shown.points, "color": shown.colors}
    batch_for_shader(shader, "TRIS", data, indices=shown.triangles).draw(shader)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


_handler = DrawHandler(_draw)


def register() -> None:
    """Let Blender call us whenever it draws."""
    _handler.add()


def unregister() -> None:
    """Draw no more."""
    _State.shown = None
    _handler.remove()
