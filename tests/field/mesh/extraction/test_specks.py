# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces that a lattice tears off, and those that are: discs thinner than a cell, and drops."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.levels import Level, cells_of, distinct, linear, quantised, support
from neural_sculpt_addon.field.mesh.extraction.specks import SMALL_PIECE
from neural_sculpt_addon.field.mesh.proxy import extract, update
from tests.field.analytic import ball, ellipsoid

CELLS = 48


def disc(thickness, tilt):
    """An ellipsoid of radius 0.6, so many cells thick, which is one piece however it is turned."""
    network = ellipsoid((0.6, 0.6, thickness / CELLS)).network
    turn = Rotation.from_rotvec(tilt).as_matrix()
    first, *others = network.weights
    turned = first @ torch.tensor(turn, dtype=torch.float32)
    return Field(replace(network, weights=(turned, *others)))


def sizes(mesh):
    """Vertices of each connected piece, by trimesh."""
    whole = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert whole.is_watertight
    return [len(part) for part in trimesh.graph.connected_components(whole.edges)]


@pytest.mark.parametrize("thickness", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("tilt", [(0.1, 0.05, 0), (0.3, -0.2, 0), (0.6, 0.5, 0)])
def test_small_pieces_of_what_is_one_piece_are_not_shown(thickness, tilt):
    proxy = extract(disc(thickness, tilt), CELLS)
    torn = sizes(proxy.marched)
    if max(torn) >= SMALL_PIECE:
        assert min(sizes(proxy)) >= SMALL_PIECE
        assert sum(sizes(proxy)) == sum(size for size in torn if size >= SMALL_PIECE)
    np.testing.assert_allclose(np.linalg.norm(proxy.normals, axis=1), 1, atol=1e-5)


def test_a_thin_disc_does_come_apart_on_the_lattice():
    """Else the test above would say nothing."""
    torn = [sizes(extract(disc(0.7, tilt), CELLS).marched) for tilt in ((0.3, -0.2, 0),)]
    assert all(min(pieces) < SMALL_PIECE <= max(pieces) for pieces in torn)


def drop(place, amount):
    """Splines of eight nodes about a place: some three cells wide."""
    cells = cells_of(np.array([place], np.float32), 5) + np.indices((2, 2, 2)).reshape(3, -1).T
    return {5: Level(linear(cells.astype(np.int32), 5), quantised(np.full(8, amount)))}


@pytest.mark.parametrize(
    ("place", "amount"), [((0.6, 0.01, 0.01), -0.3), ((0.02, 0.02, 0.02), 2.0)]
)
def test_drops_and_bubbles_are_shown(place, amount):
    """A drop outside of a ball, and a bubble within it, are pieces by themselves, however small."""
    layer = drop(place, amount)
    field = ball(0.5).plus(layer)
    for proxy in (
        extract(field, CELLS),
        update(extract(ball(0.5), CELLS), field, support(layer)),
    ):
        assert len(sizes(proxy)) == 2
        assert min(sizes(proxy)) < SMALL_PIECE


def test_an_update_starts_from_the_mesh_with_its_specks():
    """What was torn off and is thick now hangs together, and what an update tears off is gone."""
    thin = disc(0.9, (0.3, -0.2, 0))
    axis = np.linspace(-0.95, 0.95, 20)
    nodes = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3).astype(np.float32)
    index = distinct(cells_of(nodes, 3), 3)
    thicker = {3: Level(index, quantised(np.full(len(index), -0.2)))}
    before = extract(thin, CELLS)
    assert len(sizes(before)) < len(sizes(before.marched))
    thick = thin.plus(thicker)
    there = update(before, thick, support(thicker))
    assert sizes(there) == sizes(extract(thick, CELLS)) and len(sizes(there)) == 1
    back = update(there, thin, support(thicker))
    np.testing.assert_array_equal(back.triangles, before.triangles)
    np.testing.assert_array_equal(back.edges, before.edges)
