# SPDX-License-Identifier: GPL-3.0-or-later
"""The ready fields against their closed forms, and Suzanne against Blender's mesh."""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.checkpoint import to_bytes
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import FOLDER, PRIMITIVES, primitive


def solid(name):
    """Signed distance of a closed form at x (N, 3), and its volume."""
    return {
        "sphere": (lambda x: np.linalg.norm(x, axis=1) - 0.6, 4 / 3 * np.pi * 0.6**3),
        "torus": (
            lambda x: np.hypot(np.hypot(x[:, 0], x[:, 1]) - 0.5, x[:, 2]) - 0.2,
            2 * np.pi**2 * 0.5 * 0.2**2,
        ),
        "box": (
            lambda x: (
                np.linalg.norm(x - np.clip(x, -0.6, 0.6), axis=1)
                - np.maximum(0.6 - np.abs(x).max(axis=1), 0)
            ),
            1.2**3,
        ),
        "capsule": (
            lambda x: np.linalg.norm(x - np.clip(x[:, 2:], -0.4, 0.4) * [0, 0, 1], axis=1) - 0.35,
            4 / 3 * np.pi * 0.35**3 + np.pi * 0.35**2 * 0.8,
        ),
    }[name]


# mean and maximum distance of the zero level from the closed form; the box has edges to round off
@pytest.mark.parametrize(
    ("name", "mean", "largest"),
    [
        ("sphere", 1e-4, 1e-3),
        ("torus", 2e-4, 2e-3),
        ("box", 1e-3, 0.02),
        ("capsule", 1e-4, 1e-3),
    ],
)
def test_the_zero_level_is_the_closed_form(name, mean, largest):
    distance, volume = solid(name)
    proxy = extract(primitive(name), 64)
    off = np.abs(distance(proxy.vertices.astype(float)))
    assert off.mean() < mean
    assert off.max() < largest
    mesh = trimesh.Trimesh(proxy.vertices, proxy.triangles, process=False)
    assert mesh.is_watertight and components(proxy) == 1
    assert mesh.volume == pytest.approx(volume, rel=0.01)
    assert mesh.euler_number == (0 if name == "torus" else 2)


@pytest.mark.parametrize("name", ["sphere", "torus", "box", "capsule"])
def test_the_field_is_a_distance_throughout_the_box(name):
    distance, _ = solid(name)
    x = np.random.default_rng(0).uniform(-1, 1, (2000, 3))
    assert np.abs(values(primitive(name), x) - distance(x)).mean() < 0.01


def test_suzanne_is_one_watertight_head_with_two_ears():
    proxy = extract(primitive("suzanne"), 128)
    mesh = trimesh.Trimesh(proxy.vertices, proxy.triangles, process=False)
    assert mesh.is_watertight and components(proxy) == 1
    assert mesh.extents.max() == pytest.approx(1.7, abs=0.01)
    assert int(mesh.extents.argmax()) == 0  # from ear to ear
    mirrored = proxy.vertices * np.array([-1, 1, 1], np.float32)
    assert np.abs(values(primitive("suzanne"), mirrored)).mean() < 5e-3


def test_every_file_is_small_and_has_a_name():
    files = {path.stem: path.stat().st_size for path in FOLDER.iterdir()}
    assert set(files) == set(PRIMITIVES)
    assert max(files.values()) < 100_000


@pytest.mark.parametrize("name", PRIMITIVES)
def test_they_have_no_detail_and_are_written_as_ever(name):
    field = primitive(name)
    assert not field.detail.levels
    assert to_bytes(field) == (FOLDER / f"{name}.safetensors").read_bytes()


def test_an_unknown_name_lists_the_known_ones():
    for name in ("../sphere", "x" * 10_000):
        with pytest.raises(SculptError, match="capsule") as caught:
            primitive(name)
        assert len(str(caught.value)) < 250
