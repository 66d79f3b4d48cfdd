# SPDX-License-Identifier: GPL-3.0-or-later
"""What a proxy of another resolution would cost, said before it is made."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Mesh, Object, UILayout

from ..scene.properties import field_of

TRIANGLE = 52  # bytes in a Blender mesh: corners, half a vertex with its normal, 3 / 2 edges
MESHED = 200  # bytes per triangle in the worker, while it is made
POINT = 6  # bytes per lattice point in the worker: its value, and two marks


def triangles(ob: Object, resolution: int) -> int:
    """About how many a proxy of `resolution` would have: as the area, with its square."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    return round(len(mesh.polygons) * (resolution / field_of(ob).resolution) ** 2)


def memory(ob: Object, resolution: int) -> tuple[int, int]:
    """Bytes that the mesh takes in Blender, and that the worker takes while it makes it."""
    count = triangles(ob, resolution)
    return TRIANGLE * count, MESHED * count + POINT * (resolution + 3) ** 3


def draw(layout: UILayout, ob: Object, resolution: int) -> None:
    """Show both as text."""
    kept, passing = memory(ob, resolution)
    lines = (
        iface_("About {} triangles").format(f"{triangles(ob, resolution):,}"),
        iface_("{} in Blender").format(_short(kept)),
        iface_("{} in the worker while it is meshed").format(_short(passing)),
    )
    column = layout.column(align=True)
    for line in lines:
        column.label(text=line, translate=False)


def _short(size: int) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{max(size / 1e6, 1):.0f} MB"
