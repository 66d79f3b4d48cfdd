# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over the 3D viewport: the brush under the mouse, and the stroke being drawn.

The brush is drawn by Blender's paint cursor, over a finished view in pixels of the window, so that
moving the mouse never redraws the scene. The stroke is drawn in the scene, in model space. Both
handlers stay from registration to its end and draw only when there is something to see.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent
from bpy.types import Object, WindowManager
from numpy.typing import NDArray

from ...interaction.recorder import Mouse, Point
from ...interaction.ribbon import ALONG, Ribbon, cursor, ribbons
from ...interaction.trace import trace
from ...stroke.brush import Brush
from ...stroke.curve import fit_curve
from ...stroke.stroke import MOST_COPIES, Stroke
from ...stroke.symmetry import images
from .. import preferences, redraw
from ..scene import chosen, stroke_list
from ..scene.brush.current_brush import current_brush, current_kind, mirror_of, radial_of, seen
from ..scene.chosen import holds_tool
from ..scene.mesh.seen_surface import grid_of, grid_soon
from ..scene.properties import field_of, find, is_field
from .draw_handler import DrawHandler
from .gpu_drawing import FAINTEST, draw_knots, draw_lines, draw_ribbons, draw_strip, over_surface
from .view import View, lay, lay_on, view_under


@dataclass(frozen=True)
class ShownStroke:
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
    stroke: ShownStroke | None = None
    anchor: Anchor | None = None
    chosen: tuple[tuple[Any, ...], tuple[NDArray[np.float64], ...]] = (), ()
    """What the lines of the chosen stroke were made of, and these lines."""


def show_stroke(
    ob: Object, stroke: Stroke, editing: bool, chosen: int | None, sculpted: bool = False
) -> None:
    """Show a stroke as it is now. Where the surface itself shows it (`sculpted`), only a line is
    drawn, by which its points can be edited.

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
        line = fit_curve(stroke.points, stroke.closed).resample(ALONG)[0]
    shown = () if sculpted else ribbons(stroke, partial(lay, ob))
    brush = seen(stroke.brush, stroke.kind)
    _State.stroke = ShownStroke(source, ob.session_uid, brush, shown, line, knots, chosen)


def shown_stroke() -> ShownStroke | None:
    """The stroke as it is shown; None when none is."""
    return _State.stroke


def hide_stroke() -> None:
    """Show no stroke, for it is sculpted or given up."""
    _State.stroke = None


def hold_brush(anchor: Anchor | None) -> None:
    """Keep the brush in one place; None lets it follow the mouse again."""
    _State.anchor = anchor


def _draw_chosen() -> None:
    """Draw the path of the stroke that the artist has chosen, in world space."""
    ob = bpy.context.active_object
    if _State.stroke is not None or ob is None or not is_field(ob) or not ob.visible_get():
        return
    strokes, place = field_of(ob).strokes, field_of(ob).active_stroke
    if not (chosen.is_chosen(ob, place) and 0 <= place < len(strokes) and strokes[place].data):
        return
    item = strokes[place]
    share = 0.0 if item.muted else item.strength
    grid = grid_soon(ob, redraw.tag_views)
    source = ob.session_uid, item.uid, item.data, share, grid
    if grid is None and _State.chosen[0][:2] != source[:2]:
        return  # until the surface is known
    if grid is not None and _State.chosen[0] != source:
        listed = [entry for entry in stroke_list.readable(ob) if entry.uid == item.uid]
        _State.chosen = (
            source,
            trace(listed[0].stroke, share, partial(lay_on, grid)) if listed else (),
        )
    *color, alpha = preferences.overlay_colors().cursor
    with over_surface(ob):
        for depth, share in (("NONE", FAINTEST), ("LESS_EQUAL", 1.0)):  # behind the surface, too
            gpu.state.depth_test_set(depth)  # pyright: ignore[reportArgumentType]
            draw_lines(_State.chosen[1], 2.5, (*color, alpha * share))  # pyright: ignore[reportArgumentType]


def draw_stroke() -> None:
    """Draw the stroke in the scene, in world space."""
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
            draw_lines([shown.line], 1.5, preferences.overlay_colors().cursor)
        if len(shown.knots):
            draw_knots(shown.knots, shown.chosen, preferences.overlay_colors().cursor)


def draw_brush(mouse: Mouse) -> None:
    """Over the view, in pixels of the window."""
    context = bpy.context
    ob, anchor = context.active_object, _State.anchor
    if ob is None or not is_field(ob) or not holds_tool(context.workspace, context.mode):
        return
    view = view_under(context.area, mouse, ob)
    if view is None:
        return
    grid = grid_soon(ob, redraw.tag_views)
    if anchor is not None and anchor.target == ob.session_uid:
        center, normal = anchor.center, anchor.normal
    elif (hit := view.hit_on(grid, mouse)) is not None:
        center, normal = hit
    else:
        return
    shown = _State.stroke
    if shown is not None:
        brush = shown.brush
    else:
        brush = seen(current_brush(context), current_kind(context))
    shape = cursor(brush, center, normal, view.axes(), partial(lay_on, grid))
    colors = preferences.overlay_colors()
    gpu.state.blend_set("ALPHA")
    *rgb, alpha = colors.cursor
    turned = images(mirror_of(ob), radial_of(context, ob))[:MOST_COPIES]  # (M, 3, 3)
    rims = [_pixels(view, shape.rim @ image.T) for image in turned]
    draw_lines(rims[:1], 2.0, (*rgb, alpha))  # pyright: ignore[reportArgumentType]
    draw_lines(rims[1:], 2.0, (*rgb, 0.4 * alpha))  # pyright: ignore[reportArgumentType]
    color = colors.carving if brush.intensity < 0 else colors.raising
    base, section = _pixels(view, shape.base), _pixels(view, shape.section)
    draw_strip(base, section, (*color[:3], 0.35 * color[3]))
    draw_lines([section], 2.5, color)
    gpu.state.blend_set("NONE")


def _pixels(view: View, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (N, 3) of model space in pixels of the window (N, 2)."""
    matrix = np.array(view.camera.perspective_matrix @ view.ob.matrix_world)  # (4, 4)
    clip = points @ matrix[:, :3].T + matrix[:, 3]  # (N, 4)
    half = np.array([view.region.width, view.region.height]) / 2
    place = clip[:, :2] / np.maximum(clip[:, 3:], 1e-6)
    return (place + 1) * half + (view.region.x, view.region.y)


handler = DrawHandler(draw_stroke)
_cursors: list[Any] = []


def register() -> None:
    """Let Blender call us whenever it draws; without a window there is nothing to draw on."""
    handler.add()
    if not bpy.app.background:
        _add_cursor()
        bpy.app.handlers.load_post.append(_add_cursor)


def unregister() -> None:
    """Draw no more."""
    hide_stroke()
    hold_brush(None)
    handler.remove()
    if _cursors:
        bpy.app.handlers.load_post.remove(_add_cursor)
        WindowManager.draw_cursor_remove(_cursors.pop())


@persistent
def _add_cursor(*_: object) -> None:
    """Add the cursor; again after each load of a file, which removes the window manager's
    cursors."""
    if _cursors:
        WindowManager.draw_cursor_remove(_cursors.pop())
    _cursors.append(WindowManager.draw_cursor_add(draw_brush, (), "VIEW_3D", "WINDOW"))
