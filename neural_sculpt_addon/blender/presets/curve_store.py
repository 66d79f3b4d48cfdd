# SPDX-License-Identifier: GPL-3.0-or-later
"""The curve widgets of the brush, and what they show as tables.

Blender has no curve property: the curves live in float curve nodes of a hidden node tree that the
scene's brush points to. So they are saved, follow undo, and can be drawn in a panel.
Profile: [-1, 1] x [-1, 1]. Modulation and what the pen's pressure does: [0, 1] x [0, 1].
"""

from collections.abc import Sequence

import bpy
import numpy as np
from bpy.types import CurveMapping, NodeTree

from ...stroke.profile import Profile
from . import preset_file
from .preset_file import SMOOTH, Preset

TREE = ".neural_sculpt_curves"  # a leading dot hides it from menus
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


def make_curves() -> NodeTree:
    """A new hidden node tree with all curves in their first shape."""
    tree = bpy.data.node_groups.new(TREE, "ShaderNodeTree")
    for name, points in _FIRST_SHAPES.items():
        node = tree.nodes.new("ShaderNodeFloatCurve")
        node.name = name
        set_curve(tree, name, points)
    return tree


def mapping(tree: NodeTree, name: str) -> CurveMapping:
    """The curve that a widget shows; `name` is one of BOUNDS."""
    node = tree.nodes[name]
    assert isinstance(node, bpy.types.ShaderNodeFloatCurve) and node.mapping is not None
    return node.mapping


def set_curve(
    tree: NodeTree,
    name: str,
    points: Sequence[tuple[float, float]],
    handles: Sequence[str] = (),
) -> None:
    """Replace a widget's points, at least two (x, y) with increasing x.

    handles: one of `preset_file.HANDLES` for each point; smooth ones without overshoot if empty
    """
    curves = mapping(tree, name)
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
    kinds = handles or [SMOOTH] * len(points)
    for knot, location, handle in zip(line, points, kinds, strict=True):
        knot.location = location
        knot.handle_type = handle  # pyright: ignore[reportAttributeAccessIssue]
        knot.select = False
    curves.use_clip = True
    curves.update()
    curves.reset_view()


def preset(tree: NodeTree, name: str, title: str) -> Preset:
    """What a widget shows as a preset named `title`. SculptError when that is no name."""
    line = mapping(tree, name).curves[0].points
    points = tuple((round(knot.location.x, 6), round(knot.location.y, 6)) for knot in line)
    return Preset(name, title, points, tuple(knot.handle_type for knot in line))


def table(tree: NodeTree | None, name: str) -> tuple[float, ...]:
    """What a widget shows, sampled uniformly over its domain and clipped to its range.

    Without curves, what a widget shows at first.
    """
    if tree is None:
        x, y = np.array(_FIRST_SHAPES[name]).T
        return tuple(np.round(np.interp(np.linspace(*BOUNDS[name], SAMPLES), x, y), 6).tolist())
    curves = mapping(tree, name)
    curves.initialize()
    line = curves.curves[0]
    low, high = BOUNDS[name]
    values = [curves.evaluate(line, float(x)) for x in np.linspace(low, high, SAMPLES)]
    return tuple(np.round(np.clip(values, low, high), 6).tolist())
