# SPDX-License-Identifier: GPL-3.0-or-later
"""Pieces of the surface that a mesh bounds, counted by hand."""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.errors import Cancelled
from neural_sculpt_addon.common.progress import interruptible
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_pieces import find_pieces
from neural_sculpt_addon.field.fit.mesh_union import crossings


def ball(radius, facing=1, center=(0, 0, 0), fineness=3):
    mesh = trimesh.creation.icosphere(fineness, radius)
    return mesh.vertices + center, mesh.faces[:, ::facing]


def box(extents, center=(0, 0, 0)):
    mesh = trimesh.creation.box(extents)
    return mesh.vertices + center, mesh.faces


def joined(*meshes):
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def holed(mesh, share):
    vertices, faces = mesh
    return vertices, faces[np.random.default_rng(0).random(len(faces)) > share]


FINE = {"fineness": 5}  # faces too small to be cut
CASES = {
    "ball": (ball(1), 1, 0),
    "hollow": (joined(ball(1), ball(0.6, -1)), 1, 1),
    "three deep": (joined(ball(1), ball(0.7, -1), ball(0.4)), 2, 1),
    "ball in a ball": (joined(ball(1), ball(0.4)), 1, 0),
    "apart": (joined(ball(1), ball(1, 1, (3, 0, 0))), 2, 0),
    "overlapping": (joined(ball(1), ball(1, 1, (1, 0, 0))), 1, 0),
    "overlapping, fine": (joined(ball(1, **FINE), ball(0.5, 1, (1, 0, 0), **FINE)), 1, 0),
    "crossing rods": (joined(box((2, 0.03, 0.03)), box((0.03, 2, 0.03))), 1, 0),
    "stacked": (joined(box((1, 1, 1)), box((1, 1, 1), (0, 0, 1))), 1, 0),
    "resting": (joined(box((1, 1, 1)), box((0.5, 0.5, 0.5), (0, 0, 0.75))), 1, 0),
    "rods": (joined(*(box((1.7, 0.015, 0.015), (0, 0.1 * i, 0)) for i in range(7))), 7, 0),
    "scraps": (holed(ball(1, fineness=4), 0.4), 1, 0),
}


@pytest.mark.parametrize(("mesh", "solid", "cavities"), CASES.values(), ids=CASES)
def test_pieces_and_cavities(mesh, solid, cavities):
    cleaned = clean(*mesh)
    found = find_pieces(cleaned, crossings(cleaned.vertices, cleaned.triangles))
    assert (found.solid.sum(), found.cavity.sum()) == (solid, cavities)
    assert found.of_faces.shape == (len(cleaned.triangles),)
    assert not (found.solid & found.cavity).any()


def test_a_cancel_is_heard_among_many_pieces():
    """Their number makes it long: each is compared with all smaller ones."""
    many = joined(*(box([0.1] * 3, center=(x, y, 0)) for x in range(8) for y in range(8)))
    looks = []

    def look():
        looks.append(None)
        if len(looks) > 20:
            raise Cancelled

    with interruptible(look), pytest.raises(Cancelled):
        clean(*many)
    mesh = clean(*many)
    looks.clear()
    with interruptible(look), pytest.raises(Cancelled):
        find_pieces(mesh, np.empty((0, 2), np.int64))
    assert find_pieces(mesh, np.empty((0, 2), np.int64)).counted.sum() == 64
