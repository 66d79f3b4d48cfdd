# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines that were drawn with Blender's own tools: grease pencil, annotations, curves, hair.

All are read as polylines in the world. Their thickness is read as the pen's pressure, which is 1
where the thickest of the lines is thickest.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import bpy
import numpy as np
from bpy.types import Context, Object
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Line:
    """A polyline in the world.

    points:    (K, 3), K >= 1
    thickness: (K,), in any unit that all lines of one object share, not negative
    """

    name: str
    points: Array
    thickness: Array
    closed: bool = False

    def at(self, chosen: Any) -> "Line":
        """The line through some of its points, by index."""
        return replace(self, points=self.points[chosen], thickness=self.thickness[chosen])


def selected_lines(context: Context) -> list[Line]:
    """The lines of the selected objects. If some of these lines are selected, only they."""
    lines = []
    for ob in context.selected_objects or ():
        if ob.type == "GREASEPENCIL":
            lines += _relative(_grease_pencil(ob))
        elif ob.type == "GPENCIL":
            lines += _relative(_legacy_grease_pencil(ob))
        elif ob.type == "CURVE":
            lines += _relative(_curve(ob))
        elif ob.type == "CURVES":
            lines += _relative(_hair(ob))
    return lines


def annotation_lines(context: Context) -> list[Line]:
    """The annotations of the scene at the current frame, without those that lie on the screen."""
    scene: Any = context.scene
    data = scene.annotation if hasattr(scene, "annotation") else scene.grease_pencil
    lines = []
    for layer in () if data is None else data.layers:
        past = [frame for frame in layer.frames if frame.frame_number <= scene.frame_current]
        if layer.annotation_hide or not past:
            continue
        for stroke in max(past, key=lambda frame: frame.frame_number).strokes:
            if getattr(stroke, "display_mode", "3DSPACE") == "3DSPACE" and len(stroke.points):
                points = _get(stroke.points, "co", 3)
                lines.append(Line(layer.info, points, np.ones(len(points))))
    return lines


def _relative(lines: Iterable[Line]) -> list[Line]:
    """The lines with their thickness as a share of the largest."""
    lines = [line for line in lines if len(line.points)]
    largest = max((line.thickness.max() for line in lines), default=0.0) or 1.0
    return [replace(line, thickness=line.thickness / largest) for line in lines]


def _grease_pencil(ob: Object) -> Iterator[Line]:
    """From Blender 4.3 on."""
    drawings = []
    for layer in ob.data.layers:  # pyright: ignore[reportAttributeAccessIssue]
        frame = layer.current_frame()
        if _is_hidden(layer) or frame is None:
            continue
        owner = layer.parent
        matrix = owner.matrix_world @ layer.matrix_parent_inverse if owner else ob.matrix_world
        drawings.append((matrix @ layer.matrix_local, frame.drawing))
    yield from _selected([line for found in drawings for line in _drawn(ob.name, *found)])


def _is_hidden(layer: Any) -> bool:
    """Whether a layer of grease pencil is hidden, or a group that it is in."""
    return layer.hide or (layer.parent_group is not None and _is_hidden(layer.parent_group))


def _hair(ob: Object) -> Iterator[Line]:
    yield from _selected([*_drawn(ob.name, ob.matrix_world, ob.data)])


def _drawn(name: str, matrix: Any, data: Any) -> Iterator[tuple[Line, bool]]:
    """Lines kept as attributes, and whether each is selected."""
    points = _in_world(matrix, _attribute(data, "position", "vector", 3))
    radius = _attribute(data, "radius", "value", 1)
    radius = np.ones(len(points)) if radius is None else np.maximum(radius, 0.0)
    offsets = data.curve_offsets if hasattr(data, "curve_offsets") else data.curve_offset_data
    ends = _get(offsets, "value", 1, np.int32)
    cyclic = _attribute(data, "cyclic", "value", 1, np.bool_)
    chosen = _attribute(data, ".selection", "value", 1, np.bool_)
    for index, (start, end) in enumerate(pairwise(ends)):
        closed = cyclic is not None and bool(cyclic[index])
        if chosen is None:
            selected = False
        elif len(chosen) == len(points):
            selected = bool(chosen[start:end].any())
        else:
            selected = bool(chosen[index])
        yield Line(name, points[start:end], radius[start:end], closed), selected


def _legacy_grease_pencil(ob: Object) -> Iterator[Line]:
    """Blender 4.2."""
    lines = []
    for layer in ob.data.layers:  # pyright: ignore[reportAttributeAccessIssue]
        if layer.hide or layer.active_frame is None:  # pyright: ignore[reportAttributeAccessIssue]
            continue
        matrix = ob.matrix_world
        if layer.parent is not None:
            matrix = layer.parent.matrix_world @ layer.matrix_inverse  # pyright: ignore[reportAttributeAccessIssue]
        for stroke in layer.active_frame.strokes:  # pyright: ignore[reportAttributeAccessIssue]
            points = _in_world(matrix @ layer.matrix_layer, _get(stroke.points, "co", 3))  # pyright: ignore[reportAttributeAccessIssue]
            thickness = stroke.line_width * _get(stroke.points, "pressure", 1)
            line = Line(ob.name, points, thickness, stroke.use_cyclic)
            lines.append((line, bool(stroke.select)))
    yield from _selected(lines)


def _curve(ob: Object) -> Iterator[Line]:
    """The splines of a curve, without bevel and modifiers; a mesh keeps their order."""
    data = ob.data.copy()
    data.dimensions = "3D"  # flat ones would be filled  # pyright: ignore[reportAttributeAccessIssue]
    data.bevel_depth = data.extrude = 0.0  # pyright: ignore[reportAttributeAccessIssue]
    data.bevel_object = None  # pyright: ignore[reportAttributeAccessIssue]
    bare = bpy.data.objects.new("", data)
    try:
        mesh = bare.to_mesh()
        points = _in_world(ob.matrix_world, _get(mesh.vertices, "co", 3))
        edges = _get(mesh.edges, "vertices", 2, np.int32)  # (E, 2)
        bare.to_mesh_clear()
    finally:
        bpy.data.objects.remove(bare)
        bpy.data.curves.remove(data)  # pyright: ignore[reportArgumentType]
    follows = np.zeros(len(points) + 1, bool)  # whether a point goes on from the one before it
    low, high = edges.min(1), edges.max(1)
    follows[high[high == low + 1]] = True
    starts = np.flatnonzero(~follows)  # of each line, and the number of points
    closing = set(zip(low.tolist(), high.tolist(), strict=True))
    for spline, start, end in zip(ob.data.splines, starts[:-1], starts[1:], strict=False):  # pyright: ignore[reportAttributeAccessIssue]
        knots = spline.bezier_points if spline.type == "BEZIER" else spline.points
        radii = _get(knots, "radius", 1)
        at = np.linspace(0, len(radii) - 1, end - start)
        thickness = np.interp(at, np.arange(len(radii)), radii)
        closed = end - start > 2 and (start, end - 1) in closing
        yield Line(ob.name, points[start:end], thickness, bool(closed))


def _selected(lines: list[tuple[Line, bool]]) -> list[Line]:
    """The selected lines, all when none is."""
    return [line for line, chosen in lines if chosen] or [line for line, _ in lines]


def _in_world(matrix: Any, points: Array | None) -> Array:
    if points is None:
        return np.empty((0, 3))
    matrix = np.array(matrix)  # (4, 4)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _attribute(data: Any, name: str, key: str, size: int, kind: Any = np.float32) -> Any:
    """The values of an attribute, None when there is none."""
    attribute = data.attributes.get(name)
    return None if attribute is None else _get(attribute.data, key, size, kind)


def _get(items: Any, key: str, size: int, kind: Any = np.float32) -> Any:
    """One property of all items of a collection: (N,) or (N, size)."""
    flat = np.empty(len(items) * size, kind)
    items.foreach_get(key, flat)
    flat = flat.astype(float) if kind is np.float32 else flat
    return flat if size == 1 else flat.reshape(-1, size)
