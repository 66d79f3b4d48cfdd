# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences: the worker's Python and device, how fine a new proxy is, colours."""

from typing import Any, NamedTuple

import bpy
from bpy.props import EnumProperty, FloatVectorProperty, StringProperty
from bpy.types import AddonPreferences, Context

from ..worker.install.environment import Device
from . import ADDON
from .layouts import draw_installation
from .scene.proxy_properties import (
    USUAL,
    ShownAs,
    most_triangles_property,
    refine_property,
    resolution_property,
)

Color = tuple[float, float, float, float]


class OverlayColors(NamedTuple):
    """Colors of what is drawn over the 3D viewport, RGBA."""

    cursor: Color = (1.0, 1.0, 1.0, 0.9)
    raising: Color = (1.0, 0.68, 0.26, 0.75)
    carving: Color = (0.3, 0.66, 1.0, 0.75)


def _color_property(name: str, description: str, default: Color) -> Any:
    return FloatVectorProperty(
        name=name,
        description=description,
        subtype="COLOR_GAMMA",
        size=4,
        min=0.0,
        max=1.0,
        default=default,
    )


class NEURAL_SCULPT_AP_preferences(AddonPreferences):
    """Settings that hold for all files."""

    bl_idname = ADDON

    worker_python: StringProperty(
        name="Worker Python",
        description="A Python with PyTorch that runs the worker; empty for the installed one",
        subtype="FILE_PATH",
    )
    device: EnumProperty(
        name="Device",
        description="What strokes are sculpted on",
        items=[
            (Device.AUTO.name, "Auto", "A CUDA graphics card where that works, or the processor"),
            (Device.CPU.name, "CPU", "The processor"),
            (Device.CUDA.name, "CUDA", "An NVIDIA graphics card, by a PyTorch made for CUDA"),
        ],
        default=Device.AUTO.name,
    )
    resolution: resolution_property(
        "Cells along an edge of the box in which the proxy of a new field is meshed"
    )
    refine: refine_property()
    most_triangles: most_triangles_property()

    color_cursor: _color_property(
        "Brush Color", "Of the circle under the mouse", OverlayColors().cursor
    )
    color_raising: _color_property(
        "Raising Color", "Of a stroke where it raises the surface", OverlayColors().raising
    )
    color_carving: _color_property(
        "Carving Color", "Of a stroke where it carves", OverlayColors().carving
    )

    def draw(self, context: Context) -> None:
        """Draw the settings and the installation of the worker."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "resolution")
        layout.prop(self, "refine")
        row = layout.row()
        row.enabled = self.refine
        row.prop(self, "most_triangles")
        layout.prop(self, "worker_python")
        layout.prop(self, "device")
        layout.prop(self, "color_cursor")
        layout.prop(self, "color_raising")
        layout.prop(self, "color_carving")
        draw_installation(layout, context)


def device() -> Device:
    """What the worker is to sculpt on."""
    own = _preferences()
    return Device.AUTO if own is None else Device[own.device]


def named_python() -> str:
    """The worker's Python as the artist has named it; empty where they have not."""
    own = _preferences()
    return "" if own is None else own.worker_python


def new_proxy() -> ShownAs:
    """How a new field is shown."""
    own = _preferences()
    return USUAL if own is None else ShownAs(own.resolution, own.refine, own.most_triangles)


def overlay_colors() -> OverlayColors:
    """The artist's colours of the overlay."""
    own = _preferences()
    if own is None:
        return OverlayColors()
    return OverlayColors(
        tuple(own.color_cursor), tuple(own.color_raising), tuple(own.color_carving)
    )


def _preferences() -> NEURAL_SCULPT_AP_preferences | None:
    """None when the add-on was registered without being enabled."""
    addon = bpy.context.preferences.addons.get(ADDON)
    return None if addon is None else addon.preferences
