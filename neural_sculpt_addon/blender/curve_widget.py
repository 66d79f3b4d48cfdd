# SPDX-License-Identifier: GPL-3.0-or-later
"""A curve of the brush in a panel or a dialog."""

from bpy.types import UILayout

from .properties import NEURAL_SCULPT_PG_brush


def draw_curve(layout: UILayout, brush: NEURAL_SCULPT_PG_brush, word: str) -> None:
    """A curve widget; while there are no curves, for nothing is made in drawing, a button that
    makes them."""
    if brush.curves is None:
        layout.operator("neural_sculpt.make_curves", icon="FCURVE")
    else:
        layout.template_curve_mapping(brush.curves.nodes[word], "mapping")
