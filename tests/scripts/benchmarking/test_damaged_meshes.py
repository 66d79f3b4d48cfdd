# SPDX-License-Identifier: GPL-3.0-or-later
"""The damaged meshes of the fit benchmark: the shape is found again, or a sentence says why not."""

import numpy as np
import pytest
import trimesh
from benchmarking.damaged_meshes import DAMAGES, HOPELESS, IN_PLACE, MILLION

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.fit.fit import fit_mesh
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance

TORUS = trimesh.creation.torus(0.5, 0.25, major_sections=96, minor_sections=48)


def torus(x):
    return np.hypot(np.hypot(x[:, 0], x[:, 1]) - 0.5, x[:, 2]) - 0.25


@pytest.mark.parametrize("name", [name for name in DAMAGES if name != "million"])
def test_a_damaged_torus_is_a_torus_still(name):
    vertices, faces = DAMAGES[name](TORUS.vertices, TORUS.faces, np.random.default_rng(0))
    mesh = clean(vertices, faces)
    distance = MeshDistance(mesh, np.random.default_rng(0))
    x = np.random.default_rng(1).uniform(-1, 1, (3000, 3))
    found = distance(x)
    assert np.isfinite(found.value).all()
    assert (np.linalg.norm(found.gradient, axis=1) < 1.001).all()
    if name in IN_PLACE and name != "walled":  # whose walls are in the hole of this torus
        exact = torus(mesh.scale * x + mesh.center)
        clear = np.abs(exact) > 0.03
        assert np.mean((found.value < 0) == (exact < 0), where=clear) > 0.999
        assert mesh.scale * found.value[clear] == pytest.approx(exact[clear], abs=0.03)
    if name in ("tiny", "huge", "far"):
        scale = mesh.scale * TORUS.extents.max() / np.ptp(vertices, axis=0).max()
        assert found.value == pytest.approx(torus(scale * x) / scale, abs=5e-3)


def test_a_million_triangles_are_what_they_say():
    _, faces = DAMAGES["million"](TORUS.vertices, TORUS.faces, np.random.default_rng(0))
    assert MILLION <= len(faces) < 4 * MILLION


@pytest.mark.parametrize("name", HOPELESS)
def test_the_hopeless_is_refused_with_a_sentence(name):
    with pytest.raises(SculptError) as caught:
        fit_mesh(*HOPELESS[name], preset="draft")
    message = str(caught.value)
    assert message.endswith(".")
    assert len(message) < 200
