# SPDX-License-Identifier: GPL-3.0-or-later
"""The brush of the next stroke stays as the artist has set it, whatever undo and redo bring.

Its settings and curves are in brush data-blocks, to which nothing points and whose content Blender
keeps through undo. Up to 4.2, an undo to before they were made removes the data-blocks, and a redo
brings them back with their old content. So the content is written again after each step.

Older files have the settings in a scene, and the curves in a node tree of that scene. Those of the
scene in the window are taken over.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import bpy
from bpy.app.handlers import persistent
from bpy.types import CurveMapping, NodeTree, Scene

from ...presets import curve_store
from ..properties import GROUP
from .brush_properties import BRUSH, NEURAL_SCULPT_PG_brush

Points = tuple[Sequence[tuple[float, float]], Sequence[str]]
"""The points of a curve: their locations, and the kinds of their handles."""

_IN_SCENE_UNITS = {"scene_radius", "scene_intensity"}  # radius and intensity once more
_POINTER = "curves"

_kept: tuple[dict[str, Any], dict[str, Points]] = {}, {}
"""Settings and curves before a step of Blender's history."""


@persistent
def ensure(*_: object) -> None:
    """Make the brush where there is none yet."""
    curve_store.ensure_curves()
    if curve_store.data_block(BRUSH) is not None:
        return
    curve_store.make_data_block(BRUSH)
    if (scene := bpy.context.scene) is not None and scene.is_property_set(GROUP):
        _take_over(scene)


@persistent
def remember(*_: object) -> None:
    """Remember the brush before undo and redo."""
    global _kept  # noqa: PLW0603 - one file, one brush
    _kept = _settings(_brush()), _curves()


@persistent
def keep(*_: object) -> None:
    """Bring the brush back after undo and redo."""
    ensure()
    settings, curves = _kept
    _write(settings, {word: points for word, points in curves.items() if points != _curve(word)})


def _take_over(scene: Scene) -> None:
    old = getattr(scene, GROUP)
    tree: NodeTree | None = old.curves
    nodes: dict[str, Any] = {} if tree is None else {node.name: node for node in tree.nodes}
    found = {word: nodes[word] for word in curve_store.BOUNDS if word in nodes}
    _write(_settings(old), {word: _points(node.mapping) for word, node in found.items()})


def _write(settings: Mapping[str, Any], curves: Mapping[str, Points]) -> None:
    brush = _brush()
    for name, value in settings.items():
        if getattr(brush, name) != value:
            setattr(brush, name, value)
    for word, (locations, handles) in curves.items():
        curve_store.set_curve(word, locations, handles)


def _brush() -> NEURAL_SCULPT_PG_brush:
    ensure()
    return getattr(curve_store.data_block(BRUSH), GROUP)


def _settings(brush: NEURAL_SCULPT_PG_brush) -> dict[str, Any]:
    names = NEURAL_SCULPT_PG_brush.__annotations__.keys() - _IN_SCENE_UNITS - {_POINTER}
    return {name: getattr(brush, name) for name in names}


def _curves() -> dict[str, Points]:
    return {word: _curve(word) for word in curve_store.BOUNDS}


def _curve(word: str) -> Points:
    return _points(curve_store.mapping(word))


def _points(curves: CurveMapping) -> Points:
    line = curves.curves[0].points
    return [(knot.location.x, knot.location.y) for knot in line], [k.handle_type for k in line]


_HANDLERS = (
    ("load_post", ensure),
    ("undo_pre", remember),
    ("redo_pre", remember),
    ("undo_post", keep),
    ("redo_post", keep),
)


def register() -> None:
    """Listen to loading and to Blender's history; data-blocks cannot be made yet."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    bpy.app.timers.register(ensure)


def unregister() -> None:
    """Stop listening."""
    if bpy.app.timers.is_registered(ensure):
        bpy.app.timers.unregister(ensure)
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
