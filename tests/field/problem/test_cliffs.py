# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a displacement jumps: strokes whose two arms lie beside each other, ends, steep sides."""

import numpy as np
import pytest

from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.stroke import Ends, Stroke
from tests.field.analytic import ball

RISING = Modulation(points=((0, 0), (1, 1)))


def on_top(x, y):
    """Points (N, 3) of the ball of radius 0.5 above places of the plane."""
    return np.stack([x, y, np.sqrt(0.25 - x**2 - y**2)], axis=1)


def u_turn(brush, apart=0.06):
    """There and back: the arms lie so far `apart`."""
    arm, turn = np.linspace(-0.2, 0.1, 8), np.linspace(np.pi, 0, 7)[1:-1]
    half = np.full(len(arm), apart / 2)
    x = np.concatenate([-half, apart / 2 * np.cos(turn), half])
    y = np.concatenate([arm, 0.1 + apart / 2 * np.sin(turn), arm[::-1]])
    return Stroke(on_top(x, y), brush)


def straight(brush, **more):
    y = np.linspace(-0.2, 0.2, 9)
    return Stroke(on_top(0 * y, y), brush, **more)


@pytest.fixture(scope="module")
def preparation():
    return prepare(ball(0.5))


@pytest.mark.parametrize(
    ("stroke", "jumps"),
    [
        (u_turn(Brush(0.06, 0.03, modulation=RISING)), True),
        (u_turn(Brush(0.06, -0.03, modulation=RISING)), True),
        (u_turn(Brush(0.06, 0.03)), False),  # both arms are as high
        (u_turn(Brush(0.06, 0.03, modulation=RISING), apart=0.13), False),  # they do not meet
        (straight(Brush(0.06, 0.03, modulation=RISING)), False),
        (straight(Brush(0.06, 0.03), ends=Ends.FLAT), True),
        (straight(Brush(0.02, 0.02)), False),
        (straight(Brush(0.01, 0.06)), True),  # its sides are eleven times as high as wide
    ],
)
def test_what_jumps_is_found(preparation, stroke, jumps):
    problem = pose(preparation, stroke)
    assert problem.has_cliffs is jumps
    assert (problem.displaced_tubes(40, 40, None).swept is not None) is jumps


def test_images_are_looked_at_one_by_one(preparation):
    brush = Brush(0.06, 0.03, modulation=RISING)
    for stroke, jumps in ((u_turn(brush), True), (straight(brush), False)):
        problem = pose(preparation, Stroke(stroke.points, brush, mirror=frozenset("Z")))
        assert len(problem.placed) == 2
        assert problem.has_cliffs is jumps
