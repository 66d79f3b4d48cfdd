# SPDX-License-Identifier: GPL-3.0-or-later
"""How a proxy is made of a field: properties of fields, of operators and of the preferences."""

from typing import Any

from bpy.props import BoolProperty, IntProperty

DEFAULT_RESOLUTION = 128

REFINED, MOST_TRIANGLES = True, 300_000
"""Whether a new proxy is refined, and to how many triangles at most."""


def resolution_property(description: str, default: int = DEFAULT_RESOLUTION) -> Any:
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
        default=REFINED,
    )


def most_triangles_property() -> Any:
    """What a refined proxy may have."""
    return IntProperty(
        name="Most Triangles",
        description="What a refined proxy has at most, but for those that the resolution makes:"
        " where strokes need more, all of them are shown more coarsely",
        default=MOST_TRIANGLES,
        min=10_000,
        soft_max=1_000_000,
        max=5_000_000,
    )


def smooth_property() -> Any:
    """Whether a proxy is shaded as the field itself is."""
    return BoolProperty(
        name="Smooth",
        description="Shade the proxy by the normals of the field; otherwise triangles are seen",
        default=True,
    )


def refinement() -> dict[str, int]:
    """What a job is told of the refinement of a new proxy."""
    return {"triangles": MOST_TRIANGLES if REFINED else 0}
