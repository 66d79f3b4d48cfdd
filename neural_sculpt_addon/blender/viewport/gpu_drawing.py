# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines, points and ribbons drawn by the graphics card, in the scene or over a view."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy
import gpu
import numpy as np
from bpy.types import Object
from gpu_extras.batch import batch_for_shader
from numpy.typing import NDArray

from ...interaction.ribbon import Ribbon, ribbon_triangles
from .. import preferences

POINTS = "POINT_UNIFORM_COLOR" if bpy.app.version >= (4, 5, 0) else "UNIFORM_COLOR"
KNOT = 9.0  # pixels
WEAKEST = 0.45
"""Brightness of the strongest part of a ribbon; that of the weakest is 1."""
FAINTEST = 0.3
"""Opacity of a ribbon where it moves nothing; that of its highest part is 1."""

EDGE = 0.5
"""Opacity of the edges of a line, as a share of its own."""

Color = tuple[float, float, float, float]


@contextmanager
def over_surface(ob: Object) -> Iterator[None]:
    """Draw in the object's space. No depth is written: a line and its edges, which are drawn one
    over the other, would hide parts of each other."""
    writes = gpu.state.depth_mask_get()
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_mask_set(False)
    with gpu.matrix.push_pop():  # pyright: ignore[reportGeneralTypeIssues]
        gpu.matrix.multiply_matrix(ob.matrix_world)
        yield
    gpu.state.depth_test_set("NONE")
    gpu.state.depth_mask_set(writes)
    gpu.state.blend_set("NONE")


def draw_ribbons(shown: Sequence[Ribbon], opacity: float = 1.0) -> None:
    """Draw the ribbons of a stroke and of its images, which are as high and strong as it is."""
    if not shown:
        return
    colors, ribbon = preferences.overlay_colors(), shown[0]
    shade = 1 - (1 - WEAKEST) * ribbon.strength[:, None]  # (R, 1)
    color = np.where((ribbon.height < 0)[..., None], colors.carving, colors.raising)  # (R, C, 4)
    color[..., :3] *= shade[..., None]
    size = np.abs(ribbon.height)
    color[..., 3] *= opacity * (FAINTEST + (1 - FAINTEST) * size / max(size.max(), 1e-9))
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    points = np.stack([image.points for image in shown])  # (M, R, C, 3)
    firsts = np.arange(len(shown), dtype=np.int32)[:, None, None] * size.size
    data = {
        "pos": points.reshape(-1, 3).astype(np.float32),
        "color": np.tile(color.reshape(-1, 4), (len(shown), 1)).astype(np.float32),
    }
    corners = (firsts + ribbon_triangles(size.shape[1])).reshape(-1, 3)
    batch_for_shader(shader, "TRIS", data, indices=corners).draw(shader)  # pyright: ignore[reportArgumentType]
    for column in (0, points.shape[2] // 2, -1):
        edge = 0.8 * opacity * colors.cursor[3]
        draw_lines(points[:, :, column], 1.5, (*colors.cursor[:3], edge))


def draw_knots(knots: NDArray[np.float64], chosen: int | None, color: Color) -> None:
    """Draw control points (K, 3); the chosen one is larger."""
    shader = gpu.shader.from_builtin(POINTS)
    for index, knot in enumerate(knots):
        gpu.state.point_size_set(KNOT * (1.6 if index == chosen else 1.0))
        batch = batch_for_shader(shader, "POINTS", {"pos": _deep(knot[None])})  # pyright: ignore[reportArgumentType]
        shader.uniform_float("color", color)
        batch.draw(shader)
    gpu.state.point_size_set(1.0)


def draw_lines(
    lines: Sequence[NDArray[np.float64]] | NDArray[np.float64], width: float, color: Color
) -> None:
    """Draw lines through points (N, 2) or (N, 3), with edges that part them from any material."""
    if not len(lines):
        return
    pairs = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]  # (N - 1, 2, 2 or 3)
    points = np.concatenate(pairs).reshape(-1, pairs[0].shape[-1])
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    batch = batch_for_shader(shader, "LINES", {"pos": _deep(points)})  # pyright: ignore[reportArgumentType]
    *rgb, alpha = color
    edge = (*([0.0] if sum(rgb) > 1.5 else [1.0]) * 3, EDGE * alpha)
    for wide, shade in ((width + 2, edge), (width, color)):
        shader.uniform_float("lineWidth", wide * bpy.context.preferences.system.pixel_size)
        shader.uniform_float("color", shade)
        batch.draw(shader)


def draw_strip(one: NDArray[np.float64], other: NDArray[np.float64], color: Color) -> None:
    """Draw the area between two lines (N, 2) with as many points."""
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.uniform_float("color", color)
    points = np.stack([one, other], axis=1).reshape(-1, 2)
    batch_for_shader(shader, "TRI_STRIP", {"pos": _deep(points)}).draw(shader)  # pyright: ignore[reportArgumentType]


def _deep(points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Points (N, 2) or (N, 3) as the shaders take them."""
    missing = 3 - points.shape[1]
    return np.ascontiguousarray(np.pad(points, ((0, 0), (0, missing))), np.float32)
