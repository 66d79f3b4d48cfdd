# SPDX-License-Identifier: GPL-3.0-or-later
"""Any stroke at all: an edit ends with a sound field and a report, or says why it cannot.

NEURAL_SCULPT_FUZZ=500 tries so many strokes instead of a few.
"""

import os

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.edit.edit import Solver, sculpt
from neural_sculpt_addon.field.levels import LARGEST
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Direction, Ends, Stroke

MOST = int(os.environ.get("NEURAL_SCULPT_FUZZ", "6"))

height = st.floats(-1, 1, width=32)
tables = st.lists(height, min_size=2, max_size=33).map(lambda values: Profile(table=tuple(values)))
places = st.lists(st.floats(-0.875, 0.875), unique=True, max_size=12).map(sorted)


@st.composite
def splines(draw):
    x = [-1.0, *draw(places), 1.0]
    return Profile(points=tuple((x, draw(height)) for x in dict.fromkeys(np.round(x, 3))))


profiles = st.one_of(st.sampled_from(sorted(Profile.FORMULAS)).map(Profile), tables, splines())


@st.composite
def strokes(draw):
    """A random walk on the sphere of radius 0.6, of any length and roughness."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.one_of(st.integers(1, 12), st.integers(1, 500)))
    step, turning = draw(st.floats(0, 0.3)), draw(st.floats(0, 2))
    place, ahead = random.normal(size=(2, 3))
    points = []
    for _ in range(count):
        place /= np.linalg.norm(place)
        ahead += turning * random.normal(size=3)
        ahead -= ahead @ place * place
        ahead /= np.linalg.norm(ahead)
        points.append(0.6 * place)
        place = place + step * ahead
    brush = Brush(
        draw(st.floats(0.005, 0.5)),
        draw(st.floats(-0.3, 0.3)),
        draw(profiles),
        Modulation(draw(st.sampled_from(sorted(Modulation.FORMULAS)))),
    )
    factors = random.uniform(0, 2, (2, count)) if draw(st.booleans()) else (None, None)
    return Stroke(
        np.array(points),
        brush,
        draw(st.booleans()),
        *factors,
        ends=draw(st.sampled_from(Ends)),
        direction=draw(st.sampled_from(Direction)),
        mirror=frozenset(draw(st.sampled_from(["", "", "X", "YZ"]))),
    )


def check(ready, stroke, solver):
    try:
        done = sculpt(ready, stroke, solver=solver)
    except SculptError as error:
        assert str(error)
        return
    assert all(torch.isfinite(part).all() for part in done.field.network.parameters)
    for part in (done.layer or {}).values():
        assert np.isfinite(part.values).all() and np.abs(part.values).max(initial=0) <= LARGEST
    for array in (done.proxy.vertices, done.proxy.normals):
        assert np.isfinite(array).all()
    mesh = trimesh.Trimesh(done.proxy.vertices, done.proxy.triangles, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert all(np.isfinite(v) for v in done.report().values() if isinstance(v, float))


slow = settings(
    max_examples=MOST,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@slow
@given(strokes())
@pytest.mark.long
def test_any_stroke_can_be_sculpted(ready, stroke):
    check(ready, stroke, Solver.LOCAL)


@settings(slow, max_examples=max(1, MOST // 10))
@given(strokes())
def test_any_stroke_can_change_the_network(ready, stroke):
    check(ready, stroke, Solver.NETWORK)
