# SPDX-License-Identifier: GPL-3.0-or-later
"""A field's proxy as a 3D viewport shows it: from the mouse to the surface and back.

Points are in model space, the object's local space; the mouse is in pixels of the window.
"""

from dataclasses import dataclass

import numpy as np
from bpy.types import Area, Context, Object, Region, RegionView3D
from bpy_extras import view3d_utils
from mathutils import Vector
from numpy.typing import ArrayLike, NDArray

from ...interaction.recorder import Mouse, Point
from ...interaction.triangle_grid import TriangleGrid
from ..scene.mesh.seen_surface import grid_of


@dataclass(frozen=True)
class View:
    """One region that shows the object. Made anew for each event: Blender's references die."""

    ob: Object
    region: Region
    camera: RegionView3D

    def hit(self, mouse: Mouse) -> tuple[Point, Point] | None:
        """Point and normal of the proxy under the mouse. None when there is none, or when the view
        is inside of the proxy."""
        return self.hit_on(grid_of(self.ob), mouse)

    def hit_on(self, grid: TriangleGrid | None, mouse: Mouse) -> tuple[Point, Point] | None:
        """What `hit` finds, on the surface that a grid holds; None without a grid."""
        if grid is None:
            return None
        at = mouse[0] - self.region.x, mouse[1] - self.region.y
        to_model = self.ob.matrix_world.inverted_safe()
        start = to_model @ view3d_utils.region_2d_to_origin_3d(self.region, self.camera, at)
        ahead = view3d_utils.region_2d_to_vector_3d(self.region, self.camera, at)
        ahead = np.array(to_model.to_3x3() @ ahead)  # (3,)
        found = grid.cast(np.array(start), ahead)
        if found is None or found[1] @ ahead > 0:
            return None
        return as_point(found[0].tolist()), as_point(found[1].tolist())

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
        """Pixels that a length of model space measures at a point."""
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


def object_under(context: Context, mouse: Mouse) -> Object | None:
    """The first object of any kind that a 3D viewport shows under the mouse."""
    area = context.area
    for region in () if area is None or area.type != "VIEW_3D" else area.regions:
        camera = region.data
        if isinstance(camera, RegionView3D) and _inside(region, mouse):
            at = mouse[0] - region.x, mouse[1] - region.y
            start = view3d_utils.region_2d_to_origin_3d(region, camera, at)
            ahead = view3d_utils.region_2d_to_vector_3d(region, camera, at)
            depsgraph = context.evaluated_depsgraph_get()
            found = context.scene.ray_cast(depsgraph, start, ahead)
            return found[4].original if found[0] else None
    return None


def over_interface(area: Area | None, mouse: Mouse) -> bool:
    """Whether a sidebar or header lies between the mouse and the view, or it is beside all
    areas."""
    if area is None:
        return True
    return any(region.type != "WINDOW" and _inside(region, mouse) for region in area.regions)


def lay(ob: Object, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The nearest points (N, 3) of the proxy, and its normals (N, 3) there."""
    return lay_on(grid_of(ob), points)


def lay_on(
    grid: TriangleGrid | None, points: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What `lay` finds, on the surface that a grid holds; the points themselves without a grid."""
    points = np.asarray(points, float).reshape(-1, 3)
    if grid is None:
        return points, np.tile((0.0, 0.0, 1.0), (len(points), 1))
    return grid.lay(points)


def as_point(vector: Vector | list[float]) -> Point:
    """Plain numbers, which outlive what Blender gave."""
    x, y, z = vector
    return x, y, z


def _inside(region: Region, mouse: Mouse) -> bool:
    """Hidden regions are one pixel wide."""
    x, y = mouse[0] - region.x, mouse[1] - region.y
    return region.width > 1 and 0 <= x < region.width and 0 <= y < region.height
