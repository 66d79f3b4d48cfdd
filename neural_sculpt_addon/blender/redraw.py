# SPDX-License-Identifier: GPL-3.0-or-later
"""Ask Blender to draw again: it does not know when the worker has news."""

import bpy


def tag_views() -> None:
    """Redraw all 3D viewports."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def tag_panels() -> None:
    """Redraw the preferences and all open sidebars of 3D viewports. To tag a closed sidebar would
    redraw the whole window."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PREFERENCES":
                area.tag_redraw()
            elif area.type == "VIEW_3D" and area.spaces.active.show_region_ui:
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
