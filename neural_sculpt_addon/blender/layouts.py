# SPDX-License-Identifier: GPL-3.0-or-later
"""What the preferences and the sidebar both draw: long texts, the installation of the worker."""

import textwrap

from bpy.types import Context, UILayout

from ..worker.install.installer import installer
from .locale.translations import translated

CHARACTER = 7.0  # width of one in pixels, on average, at a scale of 1


def draw_text(layout: UILayout, context: Context, text: str, icon: str = "NONE") -> None:
    """A text in as many labels as it needs, for a label that is too long is cut off."""
    width = context.region.width / (CHARACTER * context.preferences.system.ui_scale) - 6
    column = layout.column(align=True)
    for number, line in enumerate(textwrap.wrap(text, max(int(width), 20))):
        column.label(text=line, icon="BLANK1" if number else icon, translate=False)  # pyright: ignore[reportArgumentType]


def draw_installation(layout: UILayout, context: Context) -> None:
    """The button that installs the worker, and how far that is."""
    if installer.running:
        said = translated(installer.message)
        layout.progress(factor=installer.fraction, text=said, translate=False)
        layout.operator("neural_sculpt.cancel_installation", icon="CANCEL")
    else:
        layout.operator("neural_sculpt.install_worker", icon="IMPORT")
    if installer.error:
        draw_text(layout, context, translated(installer.error), "ERROR")
