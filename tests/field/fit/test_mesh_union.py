# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed parts that stick into each other, of few large faces: what is made of them is their union.

What is inside of it is worked out from the solid angles of each part's own faces.
"""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.field.fit.fit import fit_mesh
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance
from neural_sculpt_addon.field.geometry import areas


def box(size, center=(0, 0, 0)):
    return trimesh.creation.box(size).apply_translation(center)


def solid_angle(part, points):
    """Winding numbers (N,) of a part, by the formula of Van Oosterom and Strackee."""
    a, b, c = np.moveaxis(part.vertices[part.faces][None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    up = (a * np.cross(b, c)).sum(axis=2)
    down = la * lb * lc + lc * (a * b).sum(axis=2) + la * (b * c).sum(axis=2)
    down += lb * (c * a).sum(axis=2)
    return np.arctan2(up, down).sum(axis=1) / (2 * np.pi)


def within(parts, points):
    """Whether points are in any of the parts."""
    return np.any([np.abs(solid_angle(part, points)) > 0.5 for part in parts], axis=0)


def made_of(parts):
    """The signed distance to the union as a function of points of the parts' space, and its
    surface there.
    """
    whole = trimesh.util.concatenate(parts)
    mesh = clean(whole.vertices, whole.faces)
    distance = MeshDistance(mesh, np.random.default_rng(0))
    surface = distance.surface(4000, np.random.default_rng(1)).points * mesh.scale + mesh.center
    return lambda x: distance((x - mesh.center) / mesh.scale).value * mesh.scale, surface


def around(parts, count=1500):
    vertices = np.concatenate([part.vertices for part in parts])
    spread = np.random.default_rng(3).random((count, 3))
    return vertices.min(axis=0) + spread * np.ptp(vertices, axis=0)


def outline(parts, count=8000):
    """Points of the surface of the union: just beside them is no part."""
    found = []
    for part in parts:
        points, faces = trimesh.sample.sample_surface(part, count, seed=1)
        found.append(points[~within(parts, points + 1e-5 * part.face_normals[faces])])
    return np.concatenate(found)


CROSS = [
    box((2, 2, 2)),
    box((1, 1, 3), (0.3, 0.2, 1)),
    box((3, 0.3, 0.4), (0.3, 0.2, 0.1)),
]


@pytest.mark.parametrize("turned", [0.0, 0.7])
@pytest.mark.parametrize(
    "parts",
    [
        CROSS,
        [box((2, 2, 2)), box((1, 1, 2), (1, 0.3, 0))],  # two faces of each lie in one plane
        [box((2, 2, 2)), box((2, 2, 2), (0, 0, 2))],  # they share a face
        [box((2, 2, 2)), box((1, 1, 1), (0, 0, 1.5))],  # one stands on the other
        [box((2, 2, 2)), box((2, 2, 2))],
        [box((2, 2, 2)), box((0.02, 0.02, 3), (0.1, 0.2, 0))],  # a needle through large faces
    ],
)
def test_the_union_of_boxes_has_no_walls_inside(parts, turned):
    turn = trimesh.transformations.rotation_matrix(turned, [1, 2, 3])
    parts = [part.copy().apply_transform(turn) for part in parts]
    distance, surface = made_of(parts)
    x = around(parts)
    value = distance(x)
    assert np.array_equal(value < 0, within(parts, x))
    for part in parts:
        smaller = part.center_mass + 0.98 * (part.vertices - part.center_mass)
        deep = trimesh.Trimesh(smaller, part.faces, process=False)
        assert not within([deep], surface).any()
    gap = np.linalg.norm(x[:300, None] - outline(parts)[None, ::2], axis=2).min(axis=1)
    assert np.abs(value[:300]) == pytest.approx(gap, abs=0.12)
    assert (np.abs(value[:300]) < gap + 0.01).all()


def test_a_row_of_parts_side_by_side_has_no_walls_where_it_is_sunk():
    """Teeth in a gum. Rounding leaves their lower faces apart here, and has them overlap there."""
    teeth = [
        trimesh.creation.box(bounds=[[0.1 * i - 0.4, -0.1, -0.2], [0.1 * i - 0.3, 0.1, 0.2]])
        for i in range(8)
    ]
    distance, _ = made_of([box((2, 1, 1), (0, 0, -0.5)), *teeth])
    x = np.stack([np.linspace(-0.2, 0.2, 50), np.zeros(50), np.full(50, -0.2)], axis=1)
    assert distance(x) == pytest.approx(-np.hypot(0.1, 0.2), abs=1e-6)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_many_parts_that_are_inside_out_together_are_what_they_are_otherwise(seed):
    """What several of them enclose together is no cavity of theirs, as in a mirrored object."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(-1, 1, (30, 3))
    high = low + rng.uniform(0.2, 1, (30, 3))
    parts = [trimesh.creation.box(bounds=bounds) for bounds in zip(low, high, strict=True)]
    for part in parts:
        part.invert()
    distance, _ = made_of(parts)
    x = around(parts, 3000)
    from_side = np.minimum(x[:, None] - low, high - x[:, None]).min(axis=2)  # (N, 30)
    clear = np.abs(from_side).min(axis=1) > 0.01
    assert np.array_equal(distance(x[clear]) < 0, (from_side.max(axis=1) > 0)[clear])


SHAPES = {
    "ball": lambda rng: trimesh.creation.icosphere(int(rng.integers(0, 3)), rng.uniform(0.4, 1)),
    "box": lambda rng: trimesh.creation.box(rng.uniform(0.4, 2, 3)),
    "torus": lambda rng: trimesh.creation.torus(
        rng.uniform(0.5, 0.9),
        rng.uniform(0.15, 0.3),
        major_sections=int(rng.integers(6, 14)),
        minor_sections=int(rng.integers(4, 8)),
    ),
}


@pytest.mark.long
@settings(max_examples=8, deadline=None)
@given(
    names=st.lists(st.sampled_from(list(SHAPES)), min_size=2, max_size=5),
    seed=st.integers(0, 2**31),
    turned=st.booleans(),
)
def test_random_parts_agree_with_their_own_winding_numbers(names, seed, turned):
    """Nested and intersecting ones, all of which face outward, or all inward."""
    rng = np.random.default_rng(seed)
    parts = []
    for name in names:
        turn = trimesh.transformations.random_rotation_matrix(rng.random(3))
        part = SHAPES[name](rng).apply_transform(turn)
        parts.append(part.apply_translation(rng.uniform(-0.6, 0.6, 3)))
    given = [part.copy() for part in parts]
    if turned:
        for part in given:
            part.invert()
    distance, surface = made_of(given)
    x = around(parts)
    value = distance(x)
    wrong = (value < 0) != within(parts, x)
    assert not wrong[np.abs(value) > 0.01].any()
    assert wrong.mean() < 0.005
    outside = outline(parts, 3000)
    assert np.abs(distance(outside)).max() < 0.01
    inward = np.linalg.norm(surface[::40, None] - outside[None], axis=2).min(axis=1)
    assert inward.max() < 0.25


@pytest.mark.long
def test_the_field_of_three_boxes_is_one_piece():
    whole = trimesh.util.concatenate(CROSS)
    fit = fit_mesh(whole.vertices, whole.faces, preset="draft")
    assert fit.report["components"] == 1
    assert fit.report["sign_errors"] == 0
    assert fit.report["error_mean"] < 1.5e-3


@pytest.mark.long
def test_cutting_gives_the_same_faces_in_the_same_order_each_time():
    rings = [trimesh.creation.torus(0.5, 0.2).apply_translation([0.4 * i, 0, 0]) for i in range(3)]
    whole = trimesh.util.concatenate(rings)
    mesh = clean(whole.vertices, whole.faces)
    first, *others = (MeshDistance(mesh, np.random.default_rng(0)) for _ in range(3))
    assert len(first.crossing)
    for other in others:
        assert np.array_equal(first.vertices[first.faces], other.vertices[other.faces])


@pytest.mark.parametrize("fine", (False, True))
@pytest.mark.parametrize("seed", range(4))
def test_parts_that_touch_in_a_face_keep_the_rest_of_it(seed, fine):
    """A small box upon a large one, turned, so that rounding leaves their faces beside each other,
    or has them cross here and there: what bounds the two is their surfaces without twice the face
    in common."""
    random = np.random.default_rng(seed)
    large = random.uniform(0.6, 1.0, 3)
    small = large * random.uniform(0.3, 0.9, 3)
    parts = [box(large), box(small, ((large[0] + small[0]) / 2, 0, 0))]
    if fine:
        parts[1] = parts[1].subdivide().subdivide()
    whole = trimesh.util.concatenate(parts)
    whole.apply_transform(trimesh.transformations.random_rotation_matrix(random.random(3)))
    mesh = clean(whole.vertices, whole.faces)
    distance = MeshDistance(mesh, np.random.default_rng(0))
    kept = areas(distance.vertices[distance.faces]).sum() * mesh.scale**2
    expected = sum(part.area for part in parts) - 2 * small[1] * small[2]
    assert kept == pytest.approx(expected, rel=0.002)
