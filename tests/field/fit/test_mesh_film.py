# SPDX-License-Identifier: GPL-3.0-or-later
"""Films across openings, against closed forms and the geometry of any surface."""

import igl
import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.progress import go_on
from neural_sculpt_addon.field.fit.fit import fit_mesh
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance
from neural_sculpt_addon.field.fit.mesh_film import FILM_CELLS, find_film
from neural_sculpt_addon.field.fit.mesh_winding import CLOSE, Winding
from neural_sculpt_addon.field.geometry import angles, areas, face_normals
from neural_sculpt_addon.field.projection import project

H = 2 / FILM_CELLS
BALL = trimesh.creation.icosphere(5, 0.8)


def without(mesh, gone):
    """A mesh less the faces (F,) that are `gone`."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces[~gone], process=False)


def away_from(mesh):
    """How far points (N, 3) are from a mesh."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    tree = igl.AABB()
    tree.init(vertices, faces)
    return lambda points: np.sqrt(tree.squared_distance(vertices, faces, points)[0])


def film_of(mesh, threshold=0.5):
    """Triangles (T, 3, 3) of the films of a mesh in model space."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    number = Winding(vertices, faces)
    border = vertices[np.asarray(igl.boundary_facets(faces)[0]).reshape(-1, 2)]
    return find_film(
        border, lambda points: number(points, CLOSE) / threshold, away_from(mesh), go_on
    )


RADIUS, LEVEL = 0.5, 0.3003  # of the cup's rim, between two points of the lattice
CYLINDER = trimesh.creation.cylinder(RADIUS, 1.0, sections=64)
CYLINDER.apply_translation([0, 0, LEVEL - 0.5])
LOOKS = CYLINDER.face_normals[:, 2].round()
CUP, BARREL = without(CYLINDER, LOOKS == 1), without(CYLINDER, LOOKS != 0)


def test_the_film_of_a_cup_is_a_disk():
    """A second cup, upside down on the first, winds as often around a point of the disk, and both
    together once."""
    film = film_of(CUP)
    assert np.abs(film[..., 2] - LEVEL).max() < H
    inner = film[np.linalg.norm(film.mean(axis=1)[:, :2], axis=1) < RADIUS - 2 * H]
    assert inner[..., 2] == pytest.approx(LEVEL, abs=1e-4)
    assert face_normals(inner)[:, 2].min() > 0  # outward
    assert areas(film).sum() == pytest.approx(CYLINDER.facets_area.max(), rel=2 * H / RADIUS)


def test_a_tube_has_two_films_that_bulge_alike():
    film = film_of(BARREL)
    top, bottom = film[face_normals(film)[:, 2] > 0], film[face_normals(film)[:, 2] < 0]
    assert areas(top).sum() == pytest.approx(areas(bottom).sum(), rel=0.01)
    sag = LEVEL - top[..., 2].min(), bottom[..., 2].max() - (LEVEL - 1)  # the tube is hollow
    assert sag[0] == pytest.approx(sag[1], abs=1e-3)
    assert 0.02 < sag[0] < 0.2
    assert areas(top).sum() > np.pi * (RADIUS - 2 * H) ** 2


def test_vertices_of_a_film_are_where_the_winding_number_passes_the_threshold():
    film = film_of(BARREL, 0.4).reshape(-1, 3)[::20]
    far = film[away_from(BARREL)(film) > H]
    assert len(far) > len(film) / 2
    exact = igl.winding_number(np.asarray(BARREL.vertices), np.asarray(BARREL.faces), far)
    assert exact == pytest.approx(0.4, abs=3e-3)  # of 0 to 1 within a cell at the rim


@pytest.mark.parametrize(
    "mesh",
    [BALL, CUP + without(CYLINDER, LOOKS < 1)],
    ids=["closed", "a seam"],
)
def test_there_is_no_film_without_an_opening(mesh):
    assert not len(film_of(mesh))


@pytest.mark.parametrize("share", [1e-4, 0.4], ids=["two small openings", "torn"])
def test_small_openings_and_a_torn_mesh_have_no_film_but_an_inside(share):
    rng = np.random.default_rng(0)
    mesh = without(BALL, rng.permutation(len(BALL.faces)) < share * len(BALL.faces))
    distance = MeshDistance(clean(mesh.vertices, mesh.faces), rng)
    assert distance.of_mesh == len(distance.faces) < len(BALL.faces)
    points = rng.uniform(-1, 1, (5000, 3))
    radius = np.linalg.norm(points, axis=1)
    far = np.abs(radius - 0.85) > 0.05  # a mesh has a longest side of 1.7
    assert distance(points[far]).value == pytest.approx(radius[far] - 0.85, abs=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_the_distance_to_an_open_mesh_changes_no_faster_than_one_walks(seed):
    """Through the rim too, where the film ends a quarter of a cell before the mesh."""
    rng = np.random.default_rng(seed)
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    open_ball = without(BALL, BALL.triangles_center @ axis > rng.uniform(0.2, 0.6))
    distance = MeshDistance(clean(open_ball.vertices, open_ball.faces), rng)
    begin = rng.uniform(-1, 1, (20_000, 3))
    way = rng.standard_normal((20_000, 3))
    way *= rng.uniform(0, 0.1, (20_000, 1)) / np.linalg.norm(way, axis=1, keepdims=True)
    change = np.abs(distance(begin + way).value - distance(begin).value)
    assert (change - np.linalg.norm(way, axis=1)).max() < H


@pytest.mark.long
def test_a_fit_is_as_smooth_on_a_film_as_on_the_mesh():
    open_ball = without(BALL, BALL.triangles_center[:, 2] > 0.5)
    fit = fit_mesh(open_ball.vertices, open_ball.faces)
    distance = MeshDistance(clean(open_ball.vertices, open_ball.faces), np.random.default_rng(0))
    corners = distance.vertices[distance.faces[distance.of_mesh :]]
    middles, looking = corners.mean(axis=1), face_normals(corners)
    inner = np.linalg.norm(middles[:, :2], axis=1) < 0.5  # the rim is a crease
    found = project(fit.field, middles[inner].astype(np.float32))
    off = np.linalg.norm(found.points - middles[inner], axis=1)
    assert off.mean() < 2e-4
    turned = angles(found.normals, looking[inner] / np.linalg.norm(looking[inner], axis=1)[:, None])
    assert np.mean(turned) < 2.0
