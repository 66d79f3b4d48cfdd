# SPDX-License-Identifier: GPL-3.0-or-later
"""The curve widgets of the brush, and what they show as tables.

Blender has no curve property, but each of its brushes has a curve, which is saved, can be drawn in
a panel, and is no part of undo steps. So each curve of ours is that of a brush data-block, which
belongs to no mode, and no tool of Blender's offers.

Profile: [-1, 1] x [-1, 1], with the left of the stroke at -1. Modulation and what the pen's
pressure does: [0, 1] x [0, 1].
"""

from collections.abc import Sequence

import bpy
import numpy as np
from bpy.types import Brush, CurveMapping

from ...interaction import preset_file
from ...interaction.preset_file import SMOOTH_HANDLE, Preset
from ...stroke.profile import Profile

PROPERTY = "curve" if bpy.app.version < (5, 0, 0) else "curve_distance_falloff"
"""Of a brush: its curve."""

PROFILE = "profile"
MODULATION = "modulation"
PRESSURE_RADIUS = "pressure_radius"
PRESSURE_INTENSITY = "pressure_intensity"
SAMPLES = 257  # Blender's own table has 256 cells: a finer one gains nothing

BOUNDS = {
    **preset_file.BOUNDS,
    PRESSURE_RADIUS: (0.0, 1.0),
    PRESSURE_INTENSITY: (0.0, 1.0),
}
"""Of both axes of a widget."""

_CUBIC = Profile("cubic")
_FIRST_SHAPES = {
    PROFILE: tuple((v, float(_CUBIC(v))) for v in (-1.0, -0.75, -0.25, 0.0, 0.25, 0.75, 1.0)),
    MODULATION: ((0.0, 1.0), (1.0, 1.0)),
    PRESSURE_RADIUS: ((0.0, 0.0), (1.0, 1.0)),
    PRESSURE_INTENSITY: ((0.0, 0.0), (1.0, 1.0)),
}


def data_block(name: str) -> Brush | None:
    """A brush of this file."""
    return bpy.data.brushes.get((name, None))


def make_data_block(name: str) -> Brush:
    """A new brush, which the file keeps."""
    brush = bpy.data.brushes.new(name, mode="SCULPT")
    brush.use_paint_sculpt = False
    brush.use_fake_user = True
    return brush


def owner(name: str) -> Brush | None:
    """The data-block that has a curve; `name` is one of BOUNDS."""
    return data_block(f".neural_sculpt_{name}")  # a leading dot hides it from menus


def ensure_curves() -> None:
    """Make the curves that do not exist yet, with their initial shapes. Not to be called while
    Blender draws."""
    for name, points in _FIRST_SHAPES.items():
        if owner(name) is None:
            make_data_block(f".neural_sculpt_{name}")
            set_curve(name, points)


def mapping(name: str) -> CurveMapping:
    """The curve that a widget shows. KeyError when there is none yet."""
    if (brush := owner(name)) is None:
        raise KeyError(name)
    return getattr(brush, PROPERTY)


def set_curve(
    name: str,
    points: Sequence[tuple[float, float]],
    handles: Sequence[str] = (),
) -> None:
    """Replace a widget's points, at least two (x, y) with increasing x.

    handles: one of `preset_file.HANDLES` for each point; smooth ones without overshoot if empty
    """
    curves = mapping(name)
    low, high = BOUNDS[name]
    curves.use_clip = False
    curves.clip_min_x = curves.clip_min_y = low
    curves.clip_max_x = curves.clip_max_y = high
    curves.extend = "HORIZONTAL"
    line = curves.curves[0].points
    while len(line) > max(2, len(points)):
        line.remove(line[-1])
    while len(line) < len(points):
        line.new(0.0, 0.0)
    kinds = handles or [SMOOTH_HANDLE] * len(points)
    for knot, location, handle in zip(line, points, kinds, strict=True):
        knot.location = location
        knot.handle_type = handle  # pyright: ignore[reportAttributeAccessIssue]
        knot.select = False
    curves.use_clip = True
    curves.update()
    curves.reset_view()


def preset(name: str, title: str) -> Preset:
    """What a widget shows as a preset named `title`. SculptError when that is no name."""
    line = mapping(name).curves[0].points
    points = tuple((round(knot.location.x, 6), round(knot.location.y, 6)) for knot in line)
    return Preset(name, title, points, tuple(knot.handle_type for knot in line))


def table(name: str) -> tuple[float, ...]:
    """A widget's curve, sampled uniformly over its domain and clipped to its range. While no curve
    exists it is the initial one.
    """
    if owner(name) is None:
        x, y = np.array(_FIRST_SHAPES[name]).T
        return tuple(np.round(np.interp(np.linspace(*BOUNDS[name], SAMPLES), x, y), 6).tolist())
    curves = mapping(name)
    curves.initialize()
    line = curves.curves[0]
    low, high = BOUNDS[name]
    values = [curves.evaluate(line, float(x)) for x in np.linspace(low, high, SAMPLES)]
    return tuple(np.round(np.clip(values, low, high), 6).tolist())
