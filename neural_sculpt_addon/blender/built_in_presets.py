# SPDX-License-Identifier: GPL-3.0-or-later
"""The presets that come with the extension, beside the paper's formulas. No bpy here.

What each is for: a profile is cut across the stroke, a modulation along it.
"""

from .preset_file import CORNER, SMOOTH, Point, Preset


def _preset(kind: str, name: str, *points: Point, corners: tuple[int, ...] = ()) -> Preset:
    handles = tuple(CORNER if i in corners else SMOOTH for i in range(len(points)))
    return Preset(kind, name, points, handles)


def _repeated(name: str, count: int, *tooth: Point, corners: bool = False) -> Preset:
    """A modulation of `count` equal teeth; the points of one have x in [0, 1)."""
    points = tuple(((i + x) / count, y) for i in range(count) for x, y in tooth)
    points = (*points, (1.0, tooth[0][1]))
    every = tuple(range(len(points))) if corners else ()
    return _preset("modulation", name, *points, corners=every)


PROFILES = (
    _preset("profile", "Ridge", (-1, 0), (-0.4, 0.25), (0, 1), (0.4, 0.25), (1, 0), corners=(2,)),
    _preset("profile", "Crease", (-1, 0), (-0.45, 0.3), (0, -1), (0.45, 0.3), (1, 0), corners=(2,)),
    _preset(
        "profile",
        "Seam",
        *((-1, 0), (-0.5, 1), (-0.15, 0.8), (0, -0.4), (0.15, 0.8), (0.5, 1), (1, 0)),
    ),
    _preset(
        "profile", "Scales", (-1, 0), (-0.2, 0.45), (0.6, 1), (0.75, 0), (1, 0), corners=(2, 3)
    ),
    _preset("profile", "Braid", (-1, 0), (-0.5, 1), (0, 0.35), (0.5, 1), (1, 0)),
    _preset("profile", "Dent", (-1, 0), (-0.7, 0.15), (0, -1), (0.7, 0.15), (1, 0)),
    _preset(
        "profile", "Chisel", (-1, 0), (-0.7, 0), (-0.55, -1), (0.7, 0), (1, 0), corners=(1, 2, 3)
    ),
    _preset("profile", "Gem", (-1, 0), (-0.45, 1), (0.45, 1), (1, 0), corners=(0, 1, 2, 3)),
)

MODULATIONS = (
    _preset("modulation", "Taper", (0, 0), (0.3, 1), (0.7, 1), (1, 0)),
    _repeated("Scales", 6, (0, 0.1), (0.75, 1), (0.95, 0.1), corners=True),
    _repeated("Braid", 8, (0, 0.35), (0.5, 1)),
    _repeated("Beads", 6, (0, 0), (0.5, 1)),
    _repeated("Stitches", 5, (0, 0), (0.15, 1), (0.6, 1), (0.75, 0)),
)
