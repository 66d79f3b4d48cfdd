# SPDX-License-Identifier: GPL-3.0-or-later
"""How a proxy is made of a field: properties of fields, of operators and of the preferences."""

from dataclasses import dataclass
from typing import Any

from bpy.props import BoolProperty, IntProperty


@dataclass(frozen=True)
class ShownAs:
    """How a field is shown: the properties of the same names."""

    resolution: int = 128
    refine: bool = True
    most_triangles: int = 300_000
    smooth: bool = True

    def asked(self) -> dict[str, Any]:
        """What a job is told of the proxy that it makes."""
        return {
            "resolution": self.resolution,
            "triangles": self.most_triangles if self.refine else 0,
        }


USUAL = ShownAs()


def resolution_property(description: str, default: int = USUAL.resolution) -> Any:
    """A property that says how fine a proxy is."""
    return IntProperty(
        name="Resolution",
        description=description,
        default=default,
        min=16,
        soft_max=256,
        max=512,
    )


def refine_property() -> Any:
    """Whether a proxy is finer where the field is."""
    return BoolProperty(
        name="Refine",
        description="Split the triangles of the proxy where they are off the surface, so that"
        " strokes finer than the resolution are seen",
        default=USUAL.refine,
    )


def most_triangles_property() -> Any:
    """What a refined proxy may have."""
    return IntProperty(
        name="Most Triangles",
        description="What a refined proxy has at most, but for those that the resolution makes:"
        " where strokes need more, all of them are shown more coarsely",
        default=USUAL.most_triangles,
        min=10_000,
        soft_max=1_000_000,
        max=5_000_000,
    )


def smooth_property() -> Any:
    """Whether a proxy is shaded as the field itself is."""
    return BoolProperty(
        name="Smooth",
        description="Shade the proxy by the normals of the field; otherwise triangles are seen",
        default=USUAL.smooth,
    )
