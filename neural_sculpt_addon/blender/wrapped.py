# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts of any length in panels, whose labels are cut off at the end of a line."""

import textwrap

from bpy.types import Context, UILayout

CHARACTER = 7.0  # width of one in pixels, on average, at a scale of 1


def draw_text(layout: UILayout, context: Context, text: str, icon: str = "NONE") -> None:
    """A text in as many lines as it needs."""
    width = context.region.width / (CHARACTER * context.preferences.system.ui_scale) - 6
    column = layout.column(align=True)
    for number, line in enumerate(textwrap.wrap(text, max(int(width), 20))):
        column.label(text=line, icon="BLANK1" if number else icon, translate=False)  # pyright: ignore
