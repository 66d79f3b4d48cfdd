# SPDX-License-Identifier: GPL-3.0-or-later
"""Open parts: solids or shells as asked for, never filled without a word."""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.fit.fit import fit_mesh
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance
from neural_sculpt_addon.field.fit.mesh_open import Open, openings, prepare

SPHERE = trimesh.creation.icosphere(4)


def without(mesh, gone):
    """A mesh less the faces (F,) that are `gone`."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces[~gone], process=False)


def looking(mesh, z):
    return mesh.face_normals[:, 2] * z > 0.99


CYLINDER = trimesh.creation.cylinder(0.5, 1.5, sections=48)
HALF = without(SPHERE, SPHERE.triangles_center[:, 2] > 0)
CUP = without(CYLINDER, looking(CYLINDER, 1))
TUBE = without(CUP, looking(CUP, -1))
CAR = trimesh.util.concatenate(
    [
        trimesh.creation.box((4, 1.6, 1.2)).subdivide(),
        *(
            trimesh.creation.icosphere(1, 0.12).apply_translation([x, y, -0.4])
            for x in (-1, 1)
            for y in (-0.6, 0.6)
        ),
    ]
)
CAR = without(CAR, looking(CAR, -1))
FIN = trimesh.Trimesh([[0, 0, 0.9], [0.3, 0, 1.3], [-0.3, 0, 1.3]], [[0, 1, 2]])


def cleaned(mesh):
    return clean(mesh.vertices, mesh.faces)


@pytest.mark.parametrize(
    ("mesh", "count", "share"),
    [
        (SPHERE, 0, 0.0),
        (HALF, 1, 1 / 2),  # a disk over half a sphere
        (CUP, 1, np.pi / 4 / (1.5 * np.pi + np.pi / 4)),
        (TUBE, 2, 2 * np.pi / 4 / (1.5 * np.pi)),
    ],
)
def test_openings_are_counted_and_measured(mesh, count, share):
    found = openings(cleaned(mesh))
    assert found.number == count
    assert found.share == pytest.approx(share, rel=0.05, abs=1e-12)


@pytest.mark.parametrize("mesh", [HALF, CUP, TUBE, CAR], ids=["half", "cup", "tube", "car"])
@pytest.mark.parametrize("inward", [False, True])
def test_open_solids_are_filled_with_a_word(mesh, inward):
    faces = mesh.faces[:, ::-1] if inward else mesh.faces
    solid, notes = prepare(clean(mesh.vertices, faces), Open.SOLID)
    assert solid.repairs["openings"] == openings(cleaned(mesh)).number
    (note,) = notes
    assert note.startswith(f"Openings closed by a film: {solid.repairs['openings']} (")
    assert "Choose Thickness" in note
    distance = MeshDistance(solid, np.random.default_rng(0))
    middle = mesh.triangles_center.mean(axis=0)
    places = middle + np.array([[0, 0, 0], [0, 0, -0.1], [0, 3, 0], [5, 0, 0], [0, 0, 3]])
    value = distance((places - solid.center) / solid.scale).value
    assert (value < 0).tolist() == [True, True, False, False, False]


@pytest.mark.parametrize("mesh", [HALF, CUP, TUBE], ids=["half", "cup", "tube"])
def test_open_shells_are_empty(mesh):
    shell, notes = prepare(cleaned(mesh), Open.THICKNESS)
    thickness = 0.02 * mesh.extents.max()
    assert list(notes) == [f"Open parts got a thickness of {thickness:.2g}."]
    distance = MeshDistance(shell, np.random.default_rng(0))
    middle = mesh.triangles_center.mean(axis=0)
    wall = mesh.triangles_center[:: len(mesh.faces) // 40]
    value = distance((np.vstack([middle, wall]) - shell.center) / shell.scale).value
    assert value[0] > 0.1
    assert value[1:] * shell.scale == pytest.approx(-thickness / 2, rel=0.1)


def test_small_holes_are_closed_without_a_word():
    holes = without(SPHERE, np.random.default_rng(0).random(len(SPHERE.faces)) < 0.01)
    solid, notes = prepare(cleaned(holes), Open.SOLID)
    assert not notes
    assert solid.repairs["openings"] > 10


def test_a_small_fin_gets_a_thickness_with_a_word():
    mesh = trimesh.util.concatenate([SPHERE, FIN])
    solid, (note,) = prepare(cleaned(mesh), Open.SOLID)
    assert note == "Open sheets (0.9% of the area) got a thickness of 0.046."  # of 2.3
    assert solid.repairs["thickened"] == 1
    value = MeshDistance(solid, np.random.default_rng(0))(
        (np.array([[0, 0, 0], [0, 0, 1.2], [0, 0.1, 1.2]]) - solid.center) / solid.scale
    ).value
    assert (value < 0).tolist() == [True, True, False]


@pytest.mark.long
def test_a_cup_with_a_thickness_is_fitted_in_one_piece_with_a_word():
    fit = fit_mesh(CUP.vertices, CUP.faces, preset="draft", open_parts="thickness")
    assert fit.report["components"] == 1
    assert fit.report["sign_errors"] < 1e-3
    assert fit.report["notes"] == ["Open parts got a thickness of 0.03."]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "open sheet.*Open Parts, or --open thickness"),
        ({"open_parts": "solid"}, "open sheet"),
        ({"open_parts": "filled"}, "solid, thickness"),
        ({"thickness": -1.0}, "positive number"),
    ],
)
def test_what_cannot_be_done_names_the_choice(given, message):
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    with pytest.raises(SculptError, match=message):
        fit_mesh(square, [[0, 1, 2], [0, 2, 3]], preset="draft", **given)
