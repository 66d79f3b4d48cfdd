# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh that stands for the active field."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context

from ..locale.translations import OURS
from ..scene.properties import field_of
from .sidebar import CLOSED_AT_FIRST, FieldSidebar


class NEURAL_SCULPT_PT_proxy(FieldSidebar):
    """The mesh that stands for the active field."""

    bl_idname = "NEURAL_SCULPT_PT_proxy"
    bl_label = "Proxy"
    bl_options = CLOSED_AT_FIRST

    def draw(self, context: Context) -> None:
        """Draw its resolution, refinement and shading, and what can be done with it."""
        layout, field = self.layout, field_of(context.active_object)  # pyright: ignore[reportArgumentType]
        layout.label(text=f"{iface_('Resolution')}: {field.resolution}", translate=False)
        if field.refine:
            most = f"{field.most_triangles:,}"
            said = iface_("Refined to at most {} triangles").format(most)
            layout.label(text=said, translate=False)
        shading = iface_("Smooth") if field.smooth else iface_("Flat")
        layout.label(text=f"{iface_('Shading', OURS)}: {shading}", translate=False)
        layout.operator("neural_sculpt.remesh", icon="MOD_REMESH")
        layout.prop(field, "live")
        layout.operator("neural_sculpt.absorb", icon="SCULPTMODE_HLT")
        layout.operator("neural_sculpt.export", icon="EXPORT")
