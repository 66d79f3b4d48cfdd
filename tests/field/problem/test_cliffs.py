# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a displacement jumps: strokes whose two arms lie beside each other, ends, steep sides."""

import numpy as np
import pytest

from neural_sculpt_addon.common.progress import go_on
from neural_sculpt_addon.field.mesh.surface import Samples, SurfaceMesh
from neural_sculpt_addon.field.problem.cliffs import displacements, has_cliffs
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Direction, Ends, Stroke
from tests.field.analytic import ball

RISING = Modulation(points=((0, 0), (1, 1)))
ODD = Profile(points=((-1, 0), (-0.5, -1), (0, 0), (0.5, 1), (1, 0)))
FULL = Profile(table=(1, 1))


def on_top(x, y):
    """Points (N, 3) of the ball of radius 0.5 above places of the plane."""
    return np.stack([x, y, np.sqrt(0.25 - x**2 - y**2)], axis=1)


def u_turn(brush, apart=0.06, **more):
    """There and back, 21 points: the arms lie so far `apart`."""
    arm, turn = np.linspace(-0.2, 0.1, 8), np.linspace(np.pi, 0, 7)[1:-1]
    half = np.full(len(arm), apart / 2)
    x = np.concatenate([-half, apart / 2 * np.cos(turn), half])
    y = np.concatenate([arm, 0.1 + apart / 2 * np.sin(turn), arm[::-1]])
    return Stroke(on_top(x, y), brush, **more)


def straight(brush, x=0.0, **more):
    y = np.linspace(-0.2, 0.2, 9)
    return Stroke(on_top(x + 0 * y, y), brush, **more)


def ring(brush):
    turn = np.linspace(0, 2 * np.pi, 33)[:-1]
    return Stroke(on_top(0.2 * np.cos(turn), 0.2 * np.sin(turn)), brush, closed=True)


@pytest.fixture(scope="module")
def preparation():
    return prepare(ball(0.5))


@pytest.mark.parametrize(
    ("stroke", "jumps"),
    [
        (u_turn(Brush(0.06, 0.03, modulation=RISING)), True),
        (u_turn(Brush(0.06, -0.03, modulation=RISING)), True),
        (u_turn(Brush(0.06, 0.03), intensity_factors=np.linspace(0.2, 1, 21)), True),
        (u_turn(Brush(0.06, 0.03, modulation=RISING), direction=Direction.STROKE), True),
        (u_turn(Brush(0.06, 0.03)), False),  # both arms are as high
        (u_turn(Brush(0.06, 0.03, modulation=RISING), apart=0.13), False),  # they do not meet
        (ring(Brush(0.06, 0.03, modulation=RISING)), True),  # at its seam
        (ring(Brush(0.06, 0.03)), False),
        (straight(Brush(0.06, 0.03, modulation=RISING)), False),
        (straight(Brush(0.06, 0.03), ends=Ends.FLAT), True),
        (straight(Brush(0.06, 0.03, FULL)), True),
        (straight(Brush(0.02, 0.02)), False),
        (straight(Brush(0.01, 0.06)), True),  # its sides are eleven times as high as wide
    ],
)
def test_what_jumps_is_found(preparation, stroke, jumps):
    problem = pose(preparation, stroke)
    assert problem.has_cliffs is jumps
    assert (problem.displaced_tubes(40, 40, None).swept is not None) is jumps


@pytest.mark.parametrize(("profile", "jumps"), [(ODD, True), (Profile("quintic"), False)])
def test_images_jump_where_one_takes_over_from_the_other(preparation, profile, jumps):
    """Along the plane of the mirror each of two images has the same height, of the same sign. But
    0.04 beside it the own side of an odd profile is below, and that of the image above."""
    brush = Brush(0.08, 0.05, profile)
    assert not pose(preparation, straight(brush, x=0.03)).has_cliffs
    both = pose(preparation, straight(brush, x=0.03, mirror=frozenset("X")))
    assert both.has_cliffs is jumps


def test_normals_that_turn_at_an_edge_are_no_jump(preparation):
    """The ridge of a roof, whose sides look 45 degrees away: a stroke is as high on either side."""
    place = np.stack(np.meshgrid(np.arange(-20, 21), np.arange(-20, 21), indexing="ij"), axis=-1)
    corner = np.arange(41 * 41).reshape(41, 41)
    one = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:]], axis=-1)
    other = np.stack([corner[:-1, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1)
    x, y = place.reshape(-1, 2).T / 64
    points = np.stack([x, y, np.full(len(x), 0.5)], axis=1)
    side = np.stack([np.where(x < 0, -1, 1), 0 * x, np.ones(len(x))], axis=1) / np.sqrt(2)
    triangles = np.concatenate([one, other]).reshape(-1, 3).astype(np.int32)
    roof = SurfaceMesh(Samples(points.astype(np.float32), side.astype(np.float32)), triangles)
    placed = pose(preparation, Stroke(on_top(np.zeros(1), np.zeros(1)), Brush(0.3, 0.1))).placed
    assert displacements(placed, roof.vertices, go_on).max() == pytest.approx(0.1, rel=0.01)
    assert not has_cliffs(placed, roof, go_on)
