# SPDX-License-Identifier: GPL-3.0-or-later
"""A field's proxy as a 3D viewport shows it: from the mouse to the surface and back.

Points are in model space, the object's local space; the mouse is in pixels of the window. Rays use
the tree of the evaluated mesh that Blender keeps, so that one costs microseconds.
"""

# pyright: reportOptionalMemberAccess=false

from dataclasses import dataclass

import numpy as np
from bpy.types import Area, Object, Region, RegionView3D
from bpy_extras import view3d_utils
from mathutils import Vector
from numpy.typing import ArrayLike, NDArray

from .recorder import Mouse, Point

BESIDE = ((0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5))  # pixels
FARTHEST = 2.0
"""From the origin, in model space; where a ray starts. An orthographic view's starts so far away
that single precision blurs it."""


@dataclass(frozen=True)
class View:
    """One region that shows the object. Made anew for each event: Blender's references die."""

    ob: Object
    region: Region
    camera: RegionView3D

    def hit(self, mouse: Mouse) -> tuple[Point, Point] | None:
        """Point and normal of the proxy under the mouse.

        Once in a while a ray slips between two triangles and meets the far side from within; one
        close beside it does not.
        """
        x, y = mouse[0] - self.region.x, mouse[1] - self.region.y
        for right, up in BESIDE:
            found, location, normal, inner = self._cast_ray((x + right, y + up))
            if not found or not inner:
                return (as_point(location), as_point(normal)) if found else None
        return None

    def _cast_ray(self, at: Mouse) -> tuple[bool, Vector, Vector, bool]:
        """Whether a ray through a pixel of the region hits, where, and whether from within."""
        to_model = self.ob.matrix_world.inverted_safe()
        start = to_model @ view3d_utils.region_2d_to_origin_3d(self.region, self.camera, at)
        ahead = view3d_utils.region_2d_to_vector_3d(self.region, self.camera, at)
        ahead = (to_model.to_3x3() @ ahead).normalized()
        start += max(0.0, -start.dot(ahead) - FARTHEST) * ahead
        try:
            found, location, normal, _ = self.ob.ray_cast(start, ahead)
        except RuntimeError:  # hidden, or not evaluated yet: there is nothing to be hit
            return False, Vector(), Vector(), False
        return found, location, normal, normal.dot(ahead) > 0

    def cast(self, mouse: Mouse) -> Point | None:
        """The point of the proxy under the mouse."""
        hit = self.hit(mouse)
        return None if hit is None else hit[0]

    def project(self, point: Point) -> Mouse | None:
        """Where a point is seen; None when it is behind the viewer."""
        world = self.ob.matrix_world @ Vector(point)
        place = view3d_utils.location_3d_to_region_2d(self.region, self.camera, world)
        return None if place is None else (place.x + self.region.x, place.y + self.region.y)

    def pixels(self, point: Point, length: float) -> float:
        """How many pixels a length of model space measures at a point."""
        ahead = Vector(point) + length * Vector(self.axes()[0])
        here, there = self.project(point), self.project(as_point(ahead))
        return 0.0 if here is None or there is None else float(np.hypot(*np.subtract(here, there)))

    def axes(self) -> NDArray[np.float64]:
        """Unit vectors (3, 3) to the right, up, and towards the viewer, in model space."""
        turn = self.ob.matrix_world.to_3x3().inverted_safe() @ self.camera.view_rotation.to_matrix()
        axes = np.array(turn).T  # (3, 3)
        return axes / np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-12)


def view_under(area: Area | None, mouse: Mouse, ob: Object) -> View | None:
    """The view in a 3D viewport that the mouse is in; None when it is beside."""
    if area is not None and area.type == "VIEW_3D":
        for region in area.regions:
            camera = region.data
            if isinstance(camera, RegionView3D) and _inside(region, mouse):
                return View(ob, region, camera)
    return None


def over_interface(area: Area, mouse: Mouse) -> bool:
    """Whether a sidebar or header lies between the mouse and the view."""
    return any(region.type != "WINDOW" and _inside(region, mouse) for region in area.regions)


def lay(ob: Object, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The nearest points (N, 3) of the proxy, and its normals (N, 3) there."""
    laid, normals = [], []
    for point in np.asarray(points, float).reshape(-1, 3).tolist():
        found, location, normal, _ = ob.closest_point_on_mesh(point)
        laid.append(location.to_tuple() if found else point)
        normals.append(normal.to_tuple() if found else (0.0, 0.0, 1.0))
    return np.array(laid).reshape(-1, 3), np.array(normals).reshape(-1, 3)


def as_point(vector: Vector) -> Point:
    """Plain numbers, which outlive what Blender gave."""
    x, y, z = vector
    return x, y, z


def _inside(region: Region, mouse: Mouse) -> bool:
    """Hidden regions are one pixel wide."""
    x, y = mouse[0] - region.x, mouse[1] - region.y
    return region.width > 1 and 0 <= x < region.width and 0 <= y < region.height
