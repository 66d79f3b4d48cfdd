# SPDX-License-Identifier: GPL-3.0-or-later
"""The shapes that tests use are what they are said to be, and the packed networks hold them."""

import numpy as np
import pytest
import trimesh
from make_test_networks import FOLDER, SHAPES

from neural_sculpt_addon.field.checkpoint import load
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.projection import project

LENGTH = 1.7  # of the longest side of a shape, model space


def solid(name):
    return trimesh.Trimesh(*SHAPES[name](), process=False)


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_are_closed_and_in_one_piece(name):
    mesh = solid(name)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume > 0 and mesh.body_count == 1


def test_the_gear_is_a_prism_with_creases():
    mesh = solid("gear")
    half = 8 * np.sin(np.pi / 8) / 2  # of an octagon's area, radius 1: each tooth is a triangle
    assert mesh.volume == pytest.approx(0.6 * half * (1 + 0.75**2), rel=0.01)
    assert (mesh.face_adjacency_angles > np.radians(80)).sum() > 64


def test_the_limbs_of_the_star_are_thin():
    """A fifth of their length, half way out."""
    section = solid("star").section(plane_origin=[0, 0, 0.65], plane_normal=[0, 0, 1])
    assert np.ptp(section.vertices[:, 0]) == pytest.approx(0.2, abs=0.05)


@pytest.mark.parametrize(("name", "mean"), [("blob", 1e-3), ("gear", 3e-3), ("star", 1e-3)])
def test_packed_networks_hold_their_shapes(name, mean):
    mesh = solid(name)
    scale = LENGTH / mesh.extents.max()
    samples, _ = trimesh.sample.sample_surface(mesh, 5000, seed=0)
    points = scale * (samples - mesh.bounds.mean(axis=0))
    field = load(FOLDER / f"{name}.pth")
    away = np.linalg.norm(project(field, points, steps=20).points - points, axis=1)
    assert away.mean() < mean
    assert components(extract(field, 64)) == 1


def test_packed_networks_are_few_and_small():
    files = {path.stem: path.stat().st_size for path in FOLDER.iterdir()}
    assert set(files) == set(SHAPES)
    assert sum(files.values()) < 100_000
