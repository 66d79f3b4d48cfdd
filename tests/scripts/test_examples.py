# SPDX-License-Identifier: GPL-3.0-or-later
"""The stroke files of examples/ can be read, and lie on the fields that they are for."""

import numpy as np
import pytest
from make_examples import EXAMPLES, FOLDER, on_sphere, on_torus

from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.projection import project
from neural_sculpt_addon.stroke.file import parse_strokes


def test_there_is_a_file_for_each_example():
    assert {path.stem for path in FOLDER.glob("*.json")} == set(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_strokes_lie_on_the_surface(name):
    strokes = parse_strokes((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    assert len({stroke.name for stroke in strokes}) == len(strokes)
    points = np.concatenate([stroke.points for stroke in strokes])
    found = project(primitive(EXAMPLES[name].field), points)
    assert np.linalg.norm(found.points - points, axis=1).max() < 1e-3


def test_places_are_on_the_closed_forms():
    for longitude, latitude in ((0, 0), (90, 0), (20, 70)):
        assert np.linalg.norm(on_sphere(longitude, latitude)) == pytest.approx(0.6)
    assert on_sphere(0, 0) == pytest.approx((0, -0.6, 0))
    for around, over in ((0, 0), (45, 90), (200, -30)):
        x, y, z = on_torus(around, over)
        assert np.hypot(np.hypot(x, y) - 0.5, z) == pytest.approx(0.2)
