# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes on a ball of radius 0.5, and profiles."""

import numpy as np

from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke

POLE = np.array([[0, 0, 0.5]])
PEAKS = Profile(points=((-1, 0), (-0.5, 1), (0, 0), (0.5, 1), (1, 0)))


def on_ball(longitudes, latitudes, radius=0.5):
    a, b = np.broadcast_arrays(np.asarray(longitudes, float), latitudes)
    return radius * np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=1)


def belt(brush):
    return Stroke(on_ball(np.linspace(0, 2 * np.pi, 25)[:-1], 0), brush, closed=True)


def arc(brush, **words):
    return Stroke(on_ball(np.linspace(0.4, 1.0, 6), 0.4), brush, **words)


def plateau(wall: float) -> Profile:
    """One with walls of a width in radii."""
    return Profile(points=((-1, 0), (wall - 1, 1), (1 - wall, 1), (1, 0)))
