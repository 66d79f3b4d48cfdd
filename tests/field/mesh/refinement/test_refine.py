# SPDX-License-Identifier: GPL-3.0-or-later
"""Refined proxies against closed forms, root finding along rays, and trimesh."""

import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from neural_sculpt_addon.common.errors import Cancelled
from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.fit.fit import fit_mesh
from neural_sculpt_addon.field.levels import (
    Level,
    cells_of,
    centres,
    linear,
    places,
    quantised,
    spacing,
    support,
)
from neural_sculpt_addon.field.mesh.proxy import extract, update
from neural_sculpt_addon.field.mesh.refinement.refine import EDGE_TOLERANCE, again, refine
from tests.field.analytic import ball, ellipsoid, plane

MANY = 10**7


def mesh_of(refined):
    return trimesh.Trimesh(refined.vertices, refined.triangles, process=False)


def assert_closed_as(refined, coarse):
    mesh = mesh_of(refined)
    assert mesh.is_watertight and mesh.is_winding_consistent
    whole = trimesh.Trimesh(coarse.vertices, coarse.triangles, process=False)
    assert mesh.euler_number == whole.euler_number


def nodes(points, level, amount):
    """Coefficients of size `amount` at the nodes of the cells around `points` (N, 3)."""
    index = np.unique(linear(cells_of(np.asarray(points, np.float32), level), level))
    return {level: Level(index, quantised(np.broadcast_to(amount, index.shape)))}


def bumpy(seed, count=6, level=6):
    """Bumps and pits about random places of a sphere of radius 1/2."""
    random = np.random.default_rng(seed)
    spots = random.normal(size=(count, 3))
    spots *= 0.5 / np.linalg.norm(spots, axis=1, keepdims=True)
    return nodes(spots, level, random.choice([-1, 1]) * 0.02)


def test_edges_of_a_refined_ellipsoid_are_as_near_to_it_as_was_asked():
    axes = np.array([0.8, 0.5, 0.3])
    field = ellipsoid(axes)
    coarse = extract(field, 32)
    refined = refine(field, coarse, MANY)
    assert_closed_as(refined, coarse)
    assert len(refined.triangles) > len(coarse.triangles)
    np.testing.assert_array_equal(refined.vertices[: len(coarse.vertices)], coarse.vertices)

    def off(points):
        """Distance to the ellipsoid to first order, from its equation."""
        value = (points**2 / axes**2).sum(axis=1) - 1
        return np.abs(value) / np.linalg.norm(2 * points / axes**2, axis=1)

    mesh = mesh_of(refined)
    limit = EDGE_TOLERANCE * coarse.active.spacing
    assert off(refined.vertices).max() < 0.05 * limit
    middles = mesh.vertices[mesh.edges_unique].mean(axis=1)
    assert off(middles).max() < 1.05 * limit
    wanted = mesh.vertices / axes**2
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    assert (refined.normals * wanted).sum(axis=1).min() > 0.999
    assert np.degrees(mesh.face_angles.min(axis=1)).min() > 5


def test_a_bump_narrower_than_a_cell_is_shown_and_nothing_else_is_split():
    direction = np.array([0.6, 0.48, 0.64])
    level = 7
    bump = nodes([0.5 * direction], level, -0.004)
    field = ball().plus(bump)
    coarse = extract(field, 96)
    refined = refine(field, coarse, MANY)
    assert_closed_as(refined, coarse)
    random = np.random.default_rng(0)
    rays = direction + random.normal(0, 0.006, (200, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)

    def at(radius, ray):
        return float(values(field, radius * ray[None].astype(np.float32))[0])

    true = np.array([brentq(at, 0.49, 0.51, args=(ray,), xtol=1e-6) * ray for ray in rays])
    assert np.linalg.norm(true, axis=1).max() > 0.501

    def missed(mesh):
        triangles = mesh.triangles.astype(np.int64)
        square = igl.point_mesh_squared_distance(true, mesh.vertices.astype(float), triangles)[0]
        return np.sqrt(square).max()

    limit = EDGE_TOLERANCE * coarse.active.spacing
    assert missed(refined) < 1.5 * limit < missed(coarse)
    split = np.bincount(refined.parents)[: len(coarse.triangles)] > 1
    middles = coarse.vertices[coarse.triangles[split]].mean(axis=1)
    reach = 1.5 * np.sqrt(3) * spacing(level) + 1.5 * coarse.active.spacing
    assert np.linalg.norm(middles - 0.5 * direction, axis=1).max() < reach


@pytest.mark.parametrize("cells", [20, 24])
def test_no_vertex_is_put_on_the_other_side_of_a_thin_plate(cells):
    axes = np.array([0.7, 0.5, 0.03])  # thinner than a cell
    field = ellipsoid(axes)
    refined = refine(field, extract(field, cells), MANY)
    mesh = mesh_of(refined)
    outward = mesh.triangles_center / axes**2
    assert len(refined.triangles) > len(refined.coarse.triangles)
    assert ((mesh.face_normals * outward).sum(axis=1) > 0).all()


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**31), cells=st.sampled_from([24, 32, 48]), level=st.integers(4, 6))
def test_rough_fields_keep_topology_and_orientation(seed, cells, level):
    field = ball().plus(bumpy(seed, 12, level))
    coarse = extract(field, cells)
    refined = refine(field, coarse, MANY)
    assert_closed_as(refined, coarse)
    assert np.abs(refined.vertices).max() < 1
    assert (np.diff(refined.parents) >= 0).all()
    assert set(np.unique(refined.parents)) == set(range(len(coarse.triangles)))


def rough(seed, amount=0.06, level=6, count=300):
    """Noise on a sphere of radius 1/2, in cells that a coarse lattice steps over."""
    random = np.random.default_rng(seed)
    spots = random.normal(size=(count, 3))
    spots *= 0.5 / np.linalg.norm(spots, axis=1, keepdims=True)
    index = np.unique(linear(cells_of(spots.astype(np.float32), level), level))
    return {level: Level(index, quantised(random.normal(0, amount, len(index))))}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("cells", [24, 32])
def test_no_leaning_triangle_that_is_made_looks_into_the_solid(seed, cells):
    field = ball().plus(rough(seed))
    coarse = extract(field, cells)
    refined = refine(field, coarse, MANY)
    assert_closed_as(refined, coarse)
    mesh = mesh_of(refined)
    made = np.bincount(refined.parents)[refined.parents] > 1
    cosines = np.einsum("fa,fca->fc", mesh.face_normals, refined.normals[refined.triangles])
    leaning = made & (cosines.min(axis=1) < 0.55)
    assert leaning.sum() > 20
    gradient = values_and_gradients(field, mesh.triangles_center[leaning])[1]
    outward = (mesh.face_normals[leaning] * gradient).sum(axis=1)
    assert (outward > -1e-3 * np.linalg.norm(gradient, axis=1)).all()


def mesh_points(coefficients):
    """The places (N, 3) of the nodes."""
    return np.concatenate([centres(places(c.index, k), k) for k, c in coefficients.items()])


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**31), cells=st.sampled_from([48, 64, 72]))
def test_after_an_edit_it_is_that_of_the_new_proxy(seed, cells):
    before, change = ball().plus(bumpy(seed)), bumpy(seed + 1, 2)
    coarse = extract(before, cells)
    known = refine(before, coarse, MANY)
    after = before.plus(change)
    reached = support(change)
    proxy = update(coarse, after, reached)
    found, wanted = again(after, proxy, known, reached, MANY), refine(after, proxy, MANY)
    assert_closed_as(found, proxy)
    # The field is rounded otherwise where other points are evaluated beside: an edge whose middle
    # is off by just the tolerance may be split in one of both.
    assert len(found.triangles) == pytest.approx(len(wanted.triangles), rel=2e-3)
    away = (
        np.linalg.norm(found.vertices[:, None] - mesh_points(change)[None], axis=2).min(axis=1)
        > 0.25
    )
    old = {row.tobytes() for row in known.vertices}
    assert all(row.tobytes() in old for row in found.vertices[away])


def test_edits_and_their_undoing_one_after_another_leave_it_closed():
    field, coarse = ball(), extract(ball(), 64)
    refined = refine(field, coarse, MANY)
    first = len(refined.triangles)
    changes = [bumpy(seed, 3) for seed in range(4)]
    for change, sign in [*((c, 1) for c in changes), *((c, -1) for c in changes)]:
        field, reached = field.plus(change, sign), support(change)
        coarse = update(coarse, field, reached)
        refined = again(field, coarse, refined, reached, MANY)
        assert_closed_as(refined, coarse)
    assert len(refined.triangles) == pytest.approx(first, rel=0.02)
    np.testing.assert_allclose(np.linalg.norm(refined.vertices, axis=1), 0.5, atol=1e-4)


def test_a_budget_is_kept_and_used():
    field = ball().plus(bumpy(1, 20))
    coarse = extract(field, 64)
    whole = refine(field, coarse, MANY)
    count, least = len(whole.triangles), len(coarse.triangles)
    assert whole.tolerance == EDGE_TOLERANCE
    budget = (count + least) // 2
    tight = refine(field, coarse, budget)
    assert least < len(tight.triangles) <= budget < count
    assert tight.tolerance > EDGE_TOLERANCE
    none = refine(field, coarse, least - 1)
    np.testing.assert_array_equal(none.triangles, coarse.triangles)
    change = bumpy(2, 20)
    after, reached = field.plus(change), support(change)
    proxy = update(coarse, after, reached)
    for known in (whole, tight, none):
        assert len(again(after, proxy, known, reached, budget).triangles) <= budget
    more = again(after, proxy, none, reached, MANY)  # the artist allows more
    assert more.tolerance == EDGE_TOLERANCE


def test_another_resolution_begins_anew():
    field = ball().plus(bumpy(3))
    known = refine(field, extract(field, 48), MANY)
    coarse = extract(field, 64)
    found = again(field, coarse, known, np.empty(0, np.int32), MANY)
    np.testing.assert_array_equal(found.triangles, refine(field, coarse, MANY).triangles)


def test_caps_stay_flat_and_closed():
    field = plane((0.0, 0.0, 1.0), 0.1).plus(nodes([[0.0, 0.0, 0.1], [0.9, 0.9, 0.1]], 5, 0.02))
    coarse = extract(field, 32)
    refined = refine(field, coarse, MANY)
    assert_closed_as(refined, coarse)
    assert np.abs(refined.vertices).max() <= 1
    assert len(refined.triangles) > len(coarse.triangles)


def test_it_can_be_cancelled():
    def cancel(fraction, message):
        raise Cancelled

    with pytest.raises(Cancelled):
        refine(ball(), extract(ball(), 32), MANY, progress=cancel)


@pytest.mark.long
def test_creases_of_a_fitted_cube_are_as_sharp_as_its_field():
    cube = trimesh.creation.box((1.2, 1.0, 0.8))
    field = fit_mesh(cube.vertices, cube.faces, preset="draft").field
    coarse = extract(field, 32)
    refined = refine(field, coarse, MANY)
    assert_closed_as(refined, coarse)
    fine = extract(field, 160)
    beside = np.sort(fine.vertices.max(axis=0) - np.abs(fine.vertices), axis=1)[:, 1]
    crease = fine.vertices[beside < 0.02].astype(float)  # two coordinates are those of sides
    assert len(crease) > 1000

    def missed(mesh):
        given = mesh.vertices.astype(float), mesh.triangles.astype(np.int64)
        square, face, _ = igl.point_mesh_squared_distance(crease, *given)
        turned = trimesh.Trimesh(*given, process=False).face_normals[face]
        cosine = (turned * fine.normals[beside < 0.02]).sum(axis=1)
        return np.sqrt(square).mean(), np.degrees(np.arccos(cosine.clip(-1, 1))).mean()

    (off, turned), (before, turned_before) = missed(refined), missed(coarse)
    assert off < EDGE_TOLERANCE * coarse.active.spacing / 2 < before / 5
    assert turned < turned_before / 2
