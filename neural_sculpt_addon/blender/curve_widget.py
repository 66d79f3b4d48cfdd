# SPDX-License-Identifier: GPL-3.0-or-later
"""A curve of the brush in a panel or a dialog."""

from bpy.types import UILayout

from . import curve_store


def draw_curve(layout: UILayout, word: str) -> None:
    """A curve widget, when there are curves: nothing is made in drawing."""
    if (owner := curve_store.owner(word)) is not None:
        layout.template_curve_mapping(owner, curve_store.PROPERTY)
