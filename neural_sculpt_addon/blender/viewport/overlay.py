# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over the 3D viewport: the brush under the mouse, and the stroke being drawn.

The brush is drawn by Blender's paint cursor, over a finished view in pixels of the window, so that
moving the mouse never redraws the scene. The stroke is drawn in the scene, in model space. Both
handlers stay from registration to its end and draw only when there is something to see.
"""

# pyright: reportOptionalMemberAccess=false, reportArgumentType=false
# pyright: reportGeneralTypeIssues=false

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent
from bpy.types import Object, WindowManager
from gpu_extras.batch import batch_for_shader
from numpy.typing import NDArray

from ...interaction.recorder import Mouse, Point
from ...interaction.ribbon import ROWS, Ribbon, cursor, ribbon_triangles, ribbons
from ...interaction.trace import trace
from ...stroke.brush import Brush
from ...stroke.curve import fit_curve
from ...stroke.stroke import MOST_COPIES, Stroke
from ...stroke.symmetry import images
from .. import preferences
from ..scene import chosen, stroke_list
from ..scene.brush.current_brush import current_brush, current_kind, mirror_of, radial_of, seen
from ..scene.mesh.seen_surface import grid_of
from ..scene.objects import find
from ..scene.properties import field_of, is_field
from ..scene.tool import holds_tool
from .draw_handler import DrawHandler
from .view import View, lay, view_under

POINTS = "POINT_UNIFORM_COLOR" if bpy.app.version >= (4, 5, 0) else "UNIFORM_COLOR"
KNOT = 9.0  # pixels
WEAKEST = 0.45
"""How bright the strongest part of a ribbon is, the weakest being 1."""
FAINTEST = 0.3
"""How opaque a ribbon is where it moves nothing, the highest part being 1."""

EDGE = 0.5
"""How opaque the edges of a line are, by its own."""

Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class Shown:
    """A stroke that is being drawn, in model space."""

    source: tuple[Any, ...]  # what ribbons and line were made of
    target: int
    brush: Brush
    ribbons: tuple[Ribbon, ...]
    line: NDArray[np.float64]  # (N, 3)
    knots: NDArray[np.float64]  # (K, 3), control points that can be edited
    chosen: int | None


@dataclass(frozen=True)
class Anchor:
    """Where the brush is held while the mouse changes it."""

    target: int
    center: Point
    normal: Point


class _State:
    stroke: Shown | None = None
    anchor: Anchor | None = None
    chosen: tuple[tuple[Any, ...], tuple[NDArray[np.float64], ...]] = (), ()
    """What the lines of the chosen stroke were made of, and these lines."""


def show_stroke(
    ob: Object, stroke: Stroke, editing: bool, chosen: int | None, sculpted: bool = False
) -> None:
    """Show a stroke as it is now; of one that the surface itself shows only a line to edit it by.

    Most moves of the mouse add no point to it, and nothing new is made for these.
    """
    source, before = (
        (ob.session_uid, grid_of(ob), stroke.to_json(), sculpted, editing),
        _State.stroke,
    )
    nothing = stroke.points[:0]
    knots = stroke.points if editing else nothing
    if before is not None and before.source == source:
        _State.stroke = replace(before, knots=knots, chosen=chosen)
        return
    line = nothing
    if sculpted and editing:
        line = fit_curve(stroke.points, stroke.closed).resample(ROWS)[0]
    shown = () if sculpted else ribbons(stroke, partial(lay, ob))
    brush = seen(stroke.brush, stroke.kind)
    _State.stroke = Shown(source, ob.session_uid, brush, shown, line, knots, chosen)


def shown_stroke() -> Shown | None:
    """The stroke as it is shown; None when none is."""
    return _State.stroke


def hide_stroke() -> None:
    """The stroke is sculpted, or given up."""
    _State.stroke = None


def hold_brush(anchor: Anchor | None) -> None:
    """Keep the brush in one place; None lets it follow the mouse again."""
    _State.anchor = anchor


def _draw_chosen() -> None:
    """In the scene, in world space: where the stroke runs that the artist pointed at."""
    ob = bpy.context.active_object
    if _State.stroke is not None or ob is None or not is_field(ob) or not ob.visible_get():
        return
    strokes, place = field_of(ob).strokes, field_of(ob).active_stroke
    if not (chosen.is_chosen(ob, place) and 0 <= place < len(strokes) and strokes[place].data):
        return
    item = strokes[place]
    share = 0.0 if item.muted else item.strength
    source = ob.session_uid, item.uid, item.data, share, grid_of(ob)
    if _State.chosen[0] != source:
        listed = [entry for entry in stroke_list.readable(ob) if entry.uid == item.uid]
        _State.chosen = source, trace(listed[0].stroke, share, partial(lay, ob)) if listed else ()
    *color, alpha = preferences.overlay_colors().cursor
    with over_surface(ob):
        for depth, share in (("NONE", FAINTEST), ("LESS_EQUAL", 1.0)):  # behind the surface, too
            gpu.state.depth_test_set(depth)
            _draw_lines(_State.chosen[1], 2.5, (*color, alpha * share))


def _draw_stroke() -> None:
    """In the scene, in world space."""
    _draw_chosen()
    shown = _State.stroke
    ob = None if shown is None else find(shown.target)
    if shown is None or ob is None or not ob.visible_get():
        return
    with over_surface(ob):
        gpu.state.depth_test_set("LESS_EQUAL")
        draw_ribbons(shown.ribbons)
        gpu.state.depth_test_set("NONE")
        if len(shown.line):
            _draw_lines([shown.line], 1.5, preferences.overlay_colors().cursor)
        if len(shown.knots):
            _draw_knots(shown)


@contextmanager
def over_surface(ob: Object) -> Iterator[None]:
    """Draw in the object's space. No depth is written: a line and its edges, which are drawn one
    over the other, would hide parts of each other."""
    writes = gpu.state.depth_mask_get()
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_mask_set(False)
    with gpu.matrix.push_pop():
        gpu.matrix.multiply_matrix(ob.matrix_world)
        yield
    gpu.state.depth_test_set("NONE")
    gpu.state.depth_mask_set(writes)
    gpu.state.blend_set("NONE")


def draw_ribbons(shown: Sequence[Ribbon], opacity: float = 1.0) -> None:
    """Of a stroke and its images, which are as high and strong as it is."""
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
    batch_for_shader(shader, "TRIS", data, indices=corners).draw(shader)
    for column in (0, points.shape[2] // 2, -1):
        edge = 0.8 * opacity * colors.cursor[3]
        _draw_lines(points[:, :, column], 1.5, (*colors.cursor[:3], edge))


def _draw_knots(shown: Shown) -> None:
    color = preferences.overlay_colors().cursor
    shader = gpu.shader.from_builtin(POINTS)
    for index, knot in enumerate(shown.knots):
        gpu.state.point_size_set(KNOT * (1.6 if index == shown.chosen else 1.0))
        batch = batch_for_shader(shader, "POINTS", {"pos": _deep(knot[None])})
        shader.uniform_float("color", color)
        batch.draw(shader)
    gpu.state.point_size_set(1.0)


def _draw_brush(mouse: Mouse) -> None:
    """Over the view, in pixels of the window."""
    context = bpy.context
    ob, anchor = context.active_object, _State.anchor
    if ob is None or not is_field(ob) or not holds_tool(context.workspace, context.mode):
        return
    view = view_under(context.area, mouse, ob)
    if view is None:
        return
    if anchor is not None and anchor.target == ob.session_uid:
        center, normal = anchor.center, anchor.normal
    elif (hit := view.hit(mouse)) is not None:
        center, normal = hit
    else:
        return
    shown = _State.stroke
    if shown is not None:
        brush = shown.brush
    else:
        brush = seen(current_brush(context), current_kind(context))
    shape = cursor(brush, center, normal, view.axes(), partial(lay, ob))
    colors = preferences.overlay_colors()
    gpu.state.blend_set("ALPHA")
    *rgb, alpha = colors.cursor
    turned = images(mirror_of(ob), radial_of(context, ob))[:MOST_COPIES]  # (M, 3, 3)
    rims = [_pixels(view, shape.rim @ image.T) for image in turned]
    _draw_lines(rims[:1], 2.0, (*rgb, alpha))
    _draw_lines(rims[1:], 2.0, (*rgb, 0.4 * alpha))
    color = colors.carving if brush.intensity < 0 else colors.raising
    base, section = _pixels(view, shape.base), _pixels(view, shape.section)
    _draw_strip(base, section, (*color[:3], 0.35 * color[3]))
    _draw_lines([section], 2.5, color)
    gpu.state.blend_set("NONE")


def _pixels(view: View, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (N, 3) of model space in pixels of the window (N, 2)."""
    matrix = np.array(view.camera.perspective_matrix @ view.ob.matrix_world)  # (4, 4)
    clip = points @ matrix[:, :3].T + matrix[:, 3]  # (N, 4)
    half = np.array([view.region.width, view.region.height]) / 2
    place = clip[:, :2] / np.maximum(clip[:, 3:], 1e-6)
    return (place + 1) * half + (view.region.x, view.region.y)


def _draw_lines(
    lines: Sequence[NDArray[np.float64]] | NDArray[np.float64], width: float, color: Color
) -> None:
    """Lines through points (N, 2) or (N, 3), with edges that part them from any material."""
    if not len(lines):
        return
    pairs = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]  # (N - 1, 2, 2 or 3)
    points = np.concatenate(pairs).reshape(-1, pairs[0].shape[-1])
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    batch = batch_for_shader(shader, "LINES", {"pos": _deep(points)})
    *rgb, alpha = color
    edge = (*([0.0] if sum(rgb) > 1.5 else [1.0]) * 3, EDGE * alpha)
    for wide, shade in ((width + 2, edge), (width, color)):
        shader.uniform_float("lineWidth", wide * bpy.context.preferences.system.pixel_size)
        shader.uniform_float("color", shade)
        batch.draw(shader)


def _draw_strip(one: NDArray[np.float64], other: NDArray[np.float64], color: Color) -> None:
    """The area between two lines (N, 2) with as many points."""
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.uniform_float("color", color)
    points = np.stack([one, other], axis=1).reshape(-1, 2)
    batch_for_shader(shader, "TRI_STRIP", {"pos": _deep(points)}).draw(shader)


def _deep(points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Points (N, 2) or (N, 3) as the shaders take them."""
    missing = 3 - points.shape[1]
    return np.ascontiguousarray(np.pad(points, ((0, 0), (0, missing))), np.float32)


_handler = DrawHandler(_draw_stroke)
_cursors: list[Any] = []


def register() -> None:
    """Let Blender call us whenever it draws; without a window there is nothing to draw on."""
    _handler.add()
    if not bpy.app.background:
        _add_cursor()
        bpy.app.handlers.load_post.append(_add_cursor)


def unregister() -> None:
    """Draw no more."""
    hide_stroke()
    hold_brush(None)
    _handler.remove()
    if _cursors:
        bpy.app.handlers.load_post.remove(_add_cursor)
        WindowManager.draw_cursor_remove(_cursors.pop())


@persistent
def _add_cursor(*_: object) -> None:
    """Again after each load of a file, which takes the window manager's cursors with it."""
    if _cursors:
        WindowManager.draw_cursor_remove(_cursors.pop())
    _cursors.append(WindowManager.draw_cursor_add(_draw_brush, (), "VIEW_3D", "WINDOW"))
