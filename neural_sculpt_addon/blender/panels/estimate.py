# SPDX-License-Identifier: GPL-3.0-or-later
"""What a proxy of another resolution would cost, said before it is made."""

from typing import Any

import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Mesh, Object, UILayout

from ..scene.mesh import proxy_mesh
from ..scene.properties import field_of

TRIANGLE_BYTES = 52  # bytes in a Blender mesh: corners, half a vertex with its normal, 3 / 2 edges
MESHED_BYTES = 200  # bytes per triangle in the worker, while it is made
TRIANGLES_PER_FACE = 3.0  # triangles that marching cubes makes, per area of a cell's face
SAMPLED = 10_000  # triangles
POINT_BYTES = 6  # bytes per lattice point in the worker: its value, and two marks


def triangles(ob: Object, resolution: int, most: int = 0) -> int:
    """Estimated triangles of a proxy of this `resolution`: they grow with the area in cells, so
    with its square. For a refined proxy it is `most`, unless that is less."""
    mesh, group = ob.data, field_of(ob)
    assert isinstance(mesh, Mesh)
    if group.refine:  # it has more than its resolution makes
        count = TRIANGLES_PER_FACE * _area(ob) * (resolution / 2) ** 2
    else:
        count = len(mesh.polygons) * (resolution / group.resolution) ** 2
    return max(round(count), most)


def memory(ob: Object, resolution: int, most: int = 0) -> tuple[int, int]:
    """Bytes that the mesh takes in Blender, and that the worker takes while it makes it."""
    count = triangles(ob, resolution, most)
    return TRIANGLE_BYTES * count, MESHED_BYTES * count + POINT_BYTES * (resolution + 3) ** 3


def draw_refinement(layout: UILayout, owner: Any) -> None:
    """Draw the properties `refine` and `most_triangles` of an operator."""
    layout.prop(owner, "refine")
    row = layout.row()
    row.enabled = owner.refine
    row.prop(owner, "most_triangles")


def draw(layout: UILayout, ob: Object, resolution: int, most: int = 0) -> None:
    """Show both as text."""
    kept, passing = memory(ob, resolution, most)
    count = triangles(ob, resolution, most)
    said = iface_("At most {} triangles") if count == most else iface_("About {} triangles")
    lines = (
        said.format(f"{count:,}"),
        iface_("{} in Blender").format(_short(kept)),
        iface_("{} in the worker while it is meshed").format(_short(passing)),
    )
    column = layout.column(align=True)
    for line in lines:
        column.label(text=line, translate=False)


def _area(ob: Object) -> float:
    """Estimated area of a proxy, model units: n times the area of every n-th triangle."""
    mesh = proxy_mesh.mesh_of(ob)
    if len(mesh.loops) != 3 * len(mesh.polygons):
        return 0.0
    corners = proxy_mesh.corners_of(mesh)
    step = max(len(corners) // SAMPLED, 1)
    a, b, c = proxy_mesh.positions(ob)[corners[::step]].swapaxes(0, 1)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return float(areas.mean() * len(corners))


def _short(size: int) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{max(size / 1e6, 1):.0f} MB"
