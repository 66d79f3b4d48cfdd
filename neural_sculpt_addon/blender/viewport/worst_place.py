# SPDX-License-Identifier: GPL-3.0-or-later
"""Worst places: where a stroke has turned the normals of the untouched surface most, or where a fit
is farthest off its mesh. Each has a ring around it.

They are shown when the artist asks for them, until the field changes. Places are in model space.
"""

from collections.abc import Sequence

import bpy
import gpu
import numpy as np
from bpy.types import Object, RegionView3D
from bpy_extras import view3d_utils
from gpu_extras.batch import batch_for_shader
from mathutils import Vector

from ...interaction.recorder import Point
from .. import preferences
from ..scene.properties import field_of, is_field
from .draw_handler import DrawHandler

RING_RADIUS = 18.0  # pixels
SEEN_NEAR = 0.01
"""Distance, model space, between the place and the surface that is seen there, up to which the
place is visible."""


class _State:
    shown: tuple[int, str, Sequence[Point]] | None = None
    """session_uid of the object, revision of its field, and the places."""


def show(ob: Object, places: Sequence[Point]) -> None:
    """Show the rings."""
    _State.shown = ob.session_uid, field_of(ob).revision, places


def hide() -> None:
    """Show them no longer."""
    _State.shown = None


def is_shown(ob: Object) -> bool:
    """Whether rings are on the field as it is."""
    return _State.shown is not None and _State.shown[:2] == (ob.session_uid, field_of(ob).revision)


def face(ob: Object, place: Point, camera: RegionView3D) -> None:
    """Turn the view to the place if the surface hides it, or if it faces away from the view; not
    where the object is hidden itself."""
    if not ob.visible_get():
        return
    at = Vector(place)
    found, _, normal, _ = ob.closest_point_on_mesh(at)
    to_model = ob.matrix_world.inverted_safe()
    back = camera.view_rotation @ Vector((0, 0, 1))
    eye = camera.view_matrix.inverted_safe().translation if camera.is_perspective else None
    start = to_model @ (ob.matrix_world @ at + 1e3 * back if eye is None else eye)
    hit, seen, _, _ = ob.ray_cast(start, at - start)
    if hit and (seen - at).length < SEEN_NEAR:
        return
    world = ob.matrix_world.to_3x3().inverted_safe().transposed() @ normal if found else back
    if camera.view_perspective == "CAMERA":
        camera.view_perspective = "PERSP"
    camera.view_rotation = world.to_track_quat("Z", "Y")
    camera.view_location = ob.matrix_world @ at


def _draw() -> None:
    """Draw the rings over the view, in pixels of its region."""
    context = bpy.context
    ob, region, camera = context.active_object, context.region, context.region_data
    if ob is None or not is_field(ob) or not is_shown(ob) or not ob.visible_get():
        return
    assert _State.shown is not None
    gpu.state.blend_set("ALPHA")
    for place in _State.shown[2]:
        at = view3d_utils.location_3d_to_region_2d(region, camera, ob.matrix_world @ Vector(place))
        if at is not None:
            _draw_ring(at, context.preferences.system.pixel_size)
    gpu.state.blend_set("NONE")


def _draw_ring(at: Vector, scale: float) -> None:
    """A ring around a pixel."""
    angle = np.linspace(0, 2 * np.pi, 49)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)  # (N, 3)
    points = (np.array([*at, 0.0]) + RING_RADIUS * scale * circle).astype(np.float32)
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    batch = batch_for_shader(shader, "LINE_STRIP", {"pos": points})  # pyright: ignore[reportArgumentType]
    for width, color in (
        (4.5, (0.0, 0.0, 0.0, 0.6)),
        (2.0, preferences.overlay_colors().raising),
    ):
        shader.uniform_float("lineWidth", width * scale)
        shader.uniform_float("color", color)
        batch.draw(shader)


_handler = DrawHandler(_draw, "POST_PIXEL")


def register() -> None:
    """Let Blender call us whenever it draws."""
    _handler.add()


def unregister() -> None:
    """Draw no more."""
    hide()
    _handler.remove()
