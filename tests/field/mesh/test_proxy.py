# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy against dense evaluation, closed forms and trimesh."""

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values, values_and_gradients
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.levels import (
    Level,
    block,
    cells_of,
    centres,
    linear,
    quantised,
    spacing,
    support,
)
from neural_sculpt_addon.field.mesh.extraction.cell_update import update_cells
from neural_sculpt_addon.field.mesh.extraction.cells import find_active
from neural_sculpt_addon.field.mesh.extraction.lattice import CORNERS
from neural_sculpt_addon.field.mesh.extraction.march import march
from neural_sculpt_addon.field.mesh.proxy import Proxy, extract, update
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import siren
from tests.field.networks import MODELS, network_of


def ball(radius=0.6, center=(0.0, 0.0, 0.0), omega=0.3):
    """sum_i (2 / w^2) (1 - cos(w (x_i - c_i))) = R^2: a sphere within w^2 R^2 / 24, w = omega."""
    phase = [np.pi / 2 / omega - c for c in center]
    height = -1 / (omega**2 * radius)  # scaled so that the slope at the surface is 1
    last = [[height] * 3], [-3 * height - radius / 2]
    return Field(siren((np.eye(3), phase), last, omegas=[omega]))


def half_space(normal, offset):
    """sin(n . x - offset): negative below a plane, with no other zero inside the box."""
    return Field(siren(([normal], [-offset]), ([[1.0]], [0.0])))


def about(points, level, amount):
    """Coefficients of size `amount` at all nodes that reach `points` (N, 3)."""
    around = np.indices((3, 3, 3)).reshape(3, -1).T - 1
    cells = cells_of(points, level)[:, None] + around
    index = np.unique(linear(cells.reshape(-1, 3).astype(np.int32), level))
    return {level: Level(index, quantised(np.broadcast_to(amount, index.shape)))}


def everywhere(amount, level=3):
    """Coefficients of a detail that is `amount` in all of the box."""
    axis = np.linspace(-1, 1, 2 ** (level + 1) + 1)
    return about(np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3), level, amount)


def noise(level, amount, seed, count=30):
    """Random coefficients about random places."""
    random = np.random.default_rng(seed)
    spots = about(random.uniform(-1, 1, (count, 3)), level, 0.0)[level].index
    return {level: Level(spots, quantised(random.normal(0, amount, len(spots))))}


def updated(proxy, field, terms):
    """The proxy of the field with another layer, and that field."""
    after = field.plus(terms)
    return update(proxy, after, support(terms)), after


@pytest.fixture(scope="module")
def stroke(preparation):
    """The layer of a stroke around a sphere of radius 1/2, and the fields without and with it."""
    turn = np.linspace(0, 2 * np.pi, 25)[:-1]
    points = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    edit = sculpt(preparation, Stroke(points, Brush(0.2, 0.06), closed=True))
    return edit.layer, preparation.field, edit.field


def mesh_of(proxy: Proxy) -> trimesh.Trimesh:
    return trimesh.Trimesh(proxy.vertices, proxy.triangles, process=False)


def dense_lattice(field, cells):
    """f at all points of the lattice, and 1 in the ring around it (n, n, n)."""
    axis = np.linspace(-1, 1, cells + 1, dtype=np.float32)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    lattice = np.ones((cells + 3,) * 3, np.float32)
    lattice[1:-1, 1:-1, 1:-1] = values(field, points).reshape((cells + 1,) * 3)
    return lattice


def dense_active(lattice):
    """Which cells (n - 1, n - 1, n - 1) have corners that disagree; and the doubtful."""
    n = len(lattice) - 1
    corners = np.stack([lattice[i : i + n, j : j + n, k : k + n] for i, j, k in CORNERS])
    inside = corners <= 0
    # Blocks of another size round differently: signs of values this small prove nothing.
    doubtful = (np.abs(corners) < 1e-6).any(axis=0)
    return inside.any(axis=0) & ~inside.all(axis=0), doubtful


def assert_same_cells(field, cells, active=None):
    active = active or find_active(field, cells)
    expected, doubtful = dense_active(dense_lattice(field, cells))
    found = np.zeros((cells + 3,) * 3, bool)
    found.ravel()[active.index] = True
    assert not found[-1].any() and not found[:, -1].any() and not found[:, :, -1].any()
    assert not ((found[:-1, :-1, :-1] != expected) & ~doubtful).any()


def assert_closed(proxy):
    mesh = mesh_of(proxy)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > -1e-6  # an island smaller than a cell may collapse


@pytest.mark.parametrize("name", MODELS)
def test_active_cells_of_networks_equal_dense_evaluation(name):
    assert_same_cells(network_of(name), 64)


def test_active_cells_of_a_field_with_detail_equal_dense_evaluation(stroke):
    _, _, after = stroke
    assert_same_cells(after, 96)


@pytest.mark.parametrize("name", MODELS)
def test_proxies_of_networks_are_exact_and_well_shaped(name):
    field = network_of(name)
    proxy = extract(field, 128)
    assert_closed(proxy)
    mesh = mesh_of(proxy)
    value, gradient = values_and_gradients(field, proxy.vertices)
    assert np.mean(np.abs(value) / np.linalg.norm(gradient, axis=1)) < 1e-6
    value, gradient = values_and_gradients(field, mesh.triangles_center)
    assert np.mean(np.abs(value) / np.linalg.norm(gradient, axis=1)) < 5e-4
    assert np.mean(np.degrees(mesh.face_angles.min(axis=1)) < 5) < 1e-3
    assert np.mean(np.sum(mesh.face_normals * gradient, axis=1) < 0) < 1e-4


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    cells=st.sampled_from([17, 24, 32, 48]),
    omega=st.floats(0.5, 30),
    scale=st.floats(0.1, 10),
)
def test_random_fields_equal_dense_evaluation_and_give_closed_meshes(seed, cells, omega, scale):
    network = Siren.random((16, 16), omega, torch.Generator().manual_seed(seed))
    network = network.with_parameters(
        [*network.parameters[:-2], *(scale * part for part in network.parameters[-2:])]
    )
    field = Field(network)
    assert_same_cells(field, cells)
    if not len(find_active(field, cells).index):
        return
    proxy = extract(field, cells)
    assert_closed(proxy)
    assert np.abs(proxy.vertices).max() <= 1
    assert np.allclose(np.linalg.norm(proxy.normals, axis=1), 1, atol=1e-5)


@settings(max_examples=10, deadline=None)
@given(
    center=st.tuples(*[st.floats(-0.3, 0.3)] * 3),
    radius=st.floats(0.1, 0.6),
)
def test_a_ball_has_the_volume_and_normals_of_the_closed_form(center, radius):
    proxy = extract(ball(radius, center), 64)
    assert_closed(proxy)
    assert mesh_of(proxy).volume == pytest.approx(
        4 / 3 * np.pi * radius**3, rel=0.002 + 0.5 * (2 / 64 / radius) ** 2
    )
    outward = (proxy.vertices - center) / np.linalg.norm(proxy.vertices - center, axis=1)[:, None]
    assert np.sum(outward * proxy.normals, axis=1).min() > np.cos(np.radians(1))
    lengths = np.linalg.norm(proxy.vertices - center, axis=1)
    assert lengths == pytest.approx(radius, rel=2e-3)


def errors(field, points):
    value, gradient = values_and_gradients(field, points)
    return np.abs(value) / np.linalg.norm(gradient, axis=1)


def test_an_update_without_an_edit_is_the_same_mesh():
    field = primitive("torus")
    before = extract(field, 64)
    after = update(before, field, support({}))
    for name in ("triangles", "vertices", "normals", "edges"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    np.testing.assert_array_equal(after.active.index, before.active.index)


@pytest.mark.parametrize("cells", [64, 100, 128, 160])
def test_an_update_is_what_a_new_extraction_is(stroke, cells):
    """Cells and triangles are the same ones; relaxed vertices slide a little within the surface."""
    layer, old, new = stroke
    before, expected = extract(old, cells), extract(new, cells)
    after = update(before, new, support(layer))
    np.testing.assert_array_equal(after.active.index, expected.active.index)
    np.testing.assert_array_equal(after.triangles, expected.triangles)
    np.testing.assert_array_equal(after.edges, expected.edges)
    assert not np.array_equal(before.active.index, expected.active.index)
    away = np.linalg.norm(after.vertices - expected.vertices, axis=1)
    assert away.max() < 0.3 * after.active.spacing
    assert np.median(away) < 1e-3 * after.active.spacing
    assert np.mean(errors(new, after.vertices)) < 1e-5
    assert np.mean(np.degrees(mesh_of(after).face_angles.min(axis=1)) < 5) < 1e-3
    _, gradient = values_and_gradients(new, after.vertices)
    outward = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    assert np.mean(np.sum(outward * after.normals, axis=1)) > 0.9999


def test_vertices_that_no_edit_reached_keep_every_bit(stroke):
    layer, old, new = stroke
    before = extract(old, 96)
    after = update(before, new, support(layer))
    pole = np.abs(before.vertices[:, 2]) > 0.4  # the stroke ends 0.2 from the equator
    assert pole.sum() > 1000
    np.testing.assert_array_equal(
        after.vertices[np.isin(after.edges, before.edges[pole])], before.vertices[pole]
    )


@pytest.mark.long
def test_what_is_spliced_is_what_marching_cubes_makes_of_all_cells(stroke):
    layer, field, _ = stroke
    proxy = extract(field, 80)
    for terms in (layer, noise(5, 0.03, 0, 300), noise(4, 0.03, 1, 100), everywhere(-0.02)):
        before = proxy
        proxy, field = updated(proxy, field, terms)
        expected = march(proxy.active)
        assert not np.array_equal(proxy.triangles, before.triangles)
        assert np.array_equal(proxy.marched.triangles, expected.triangles)
        assert np.array_equal(proxy.marched.edges, expected.edges)
        assert np.abs(proxy.marched.vertices - expected.vertices).max() < 3 * proxy.active.spacing


def test_where_all_changed_the_flood_finds_the_same_cells_again():
    field = primitive("suzanne")
    known = find_active(field, 64)
    none = np.empty(0, np.int32)
    found = update_cells(known, np.ones(len(known.index), bool), none, field).active
    assert np.array_equal(found.index, known.index)
    assert np.array_equal(np.sign(found.values), np.sign(known.values))


def test_a_surface_that_moved_by_several_cells_is_found_again():
    """f <= 0.1 where (r^2 - R^2) / 2R <= 0.1 for R = 1/2: a ball of radius 0.59."""
    after, field = updated(extract(ball(0.5), 64), ball(0.5), everywhere(-0.1))
    assert_closed(after)
    assert_same_cells(field, 64, after.active)
    np.testing.assert_allclose(np.linalg.norm(after.vertices, axis=1), 0.35**0.5, atol=2e-3)


def test_a_piece_born_away_from_all_others_is_found():
    drop = about(np.array([[0.7, 0.7, 0.7]]), 4, -2.0)
    after, field = updated(extract(ball(0.5), 64), ball(0.5), drop)
    assert after.components.total == 2
    assert_same_cells(field, 64, after.active)
    gone = field.plus(drop, -1)
    again = update(after, gone, support(drop))
    assert again.components.total == 1
    assert np.array_equal(again.active.index, find_active(ball(0.5), 64).index)


def small_balls(field, level, seed, sign, near, far):
    """Coefficients of balls (sign 1) or hollows (-1) of 0.4 to 2.5 cells at random places so far
    from the middle, as far apart as they are large, and how many there are.

    Each asks for the distance from it within two cells, and soon after for f as it is.
    """
    random, h, centers = np.random.default_rng(seed), spacing(level), []
    while len(centers) < 12:
        center = random.uniform(-0.95, 0.95, 3)
        apart = [np.linalg.norm(center - other) for other in centers]
        if near < np.linalg.norm(center) < far and min(apart, default=1) > 12 * h:
            centers.append(center)
    parts = []
    for center in centers:
        nodes = (cells_of(center[None], level) + block(-6, 7)).astype(np.int32)
        points, radius = centres(nodes, level), random.uniform(0.4, 2.5) * h
        away = np.linalg.norm(points - center, axis=1) - radius
        wanted = np.maximum(away, -radius) + 20 * np.maximum(0, away - 2 * h)
        value = values(field, points)
        wanted = sign * np.minimum(sign * value, wanted)
        parts.append(Level(linear(nodes, level), quantised(wanted - value)))
    return {level: Level.sum(parts)}


@pytest.mark.parametrize("level", [6, 7, 8])
@pytest.mark.parametrize(
    ("sign", "radius", "near", "far"), [(1, 0.4, 0.55, 1.6), (-1, 0.85, 0, 0.75)]
)
def test_small_pieces_far_from_the_others_equal_dense_evaluation(level, sign, radius, near, far):
    field = ball(radius)
    field = field.plus(small_balls(field, level, level, sign, near, far))
    for cells in (100, 128):
        expected, _ = dense_active(dense_lattice(field, cells))
        assert ndimage.label(expected, np.ones((3, 3, 3)))[1] > 1
        assert_same_cells(field, cells)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    cells=st.sampled_from([17, 24, 32, 48]),
    omega=st.floats(0.5, 20),
    amount=st.floats(0.01, 0.1),  # more than that makes steep pieces far from any surface
)
def test_updates_of_any_field_equal_dense_evaluation_and_give_closed_meshes(
    seed, cells, omega, amount
):
    field = Field(Siren.random((16, 16), omega, torch.Generator().manual_seed(seed)))
    try:
        proxy = extract(field, cells)
    except SculptError:  # nothing there
        return
    if np.abs(proxy.vertices).max() == 1:  # where it meets the box it is extracted anew
        field = field.plus(everywhere(0.5))
    for level in (3, 5, 4):
        terms = noise(level, amount, seed + level)
        try:
            proxy, field = updated(extract(field, cells), field, terms)
        except SculptError:  # nothing is left
            return
        assert_same_cells(field, cells, proxy.active)
        mesh = mesh_of(proxy)
        assert mesh.is_watertight and mesh.is_winding_consistent
        assert np.abs(proxy.vertices).max() <= 1


@settings(max_examples=8, deadline=None)
@given(
    name=st.sampled_from(["sphere", "torus", "suzanne"]),
    cells=st.sampled_from([20, 33]),
    amount=st.floats(1e-4, 0.1),
    seed=st.integers(0, 2**31),
)
@pytest.mark.long
def test_updates_of_a_solid_are_closed_and_on_the_surface(name, cells, amount, seed):
    field = primitive(name)
    proxy = extract(field, cells)
    for step, level in enumerate((4, 5, 6)):
        proxy, field = updated(proxy, field, noise(level, amount, seed + step, 300))
        mesh = mesh_of(proxy)
        assert mesh.is_watertight and mesh.is_winding_consistent
        assert_same_cells(field, cells, proxy.active)
        inside = (np.abs(proxy.vertices) < 1).all(axis=1)
        assert np.median(errors(field, proxy.vertices[inside])) < 1e-4
        assert np.allclose(np.linalg.norm(proxy.normals, axis=1), 1, atol=1e-4)


def test_a_stroke_that_swallows_the_surface_says_what_to_do():
    with pytest.raises(SculptError, match="no surface"):
        updated(extract(ball(0.3), 32), ball(0.3), everywhere(1.0))


def test_a_stroke_may_reach_the_box():
    field = ball(0.5, (0.45, 0.0, 0.0))
    proxy, _ = updated(extract(field, 48), field, everywhere(-0.1))
    assert_closed(proxy)
    assert proxy.vertices[:, 0].max() == 1


def test_one_cell_fewer_than_a_divisible_lattice_is_as_good():
    for cells in (63, 64, 65):
        assert mesh_of(extract(ball(), cells)).volume == pytest.approx(0.9048, rel=0.01)


def test_a_half_space_is_closed_off_on_the_box_faces():
    proxy = extract(half_space((1.0, 0.0, 0.0), 0.3), 32)
    assert_closed(proxy)
    mesh = mesh_of(proxy)
    assert mesh.volume == pytest.approx(1.3 * 4, rel=1e-4)
    assert np.allclose(mesh.bounds, [[-1, -1, -1], [0.3, 1, 1]], atol=1e-5)
    assert mesh.area == pytest.approx(2 * 4 + 4 * 2 * 1.3, rel=1e-4)
    cap = np.isclose(proxy.vertices[:, 0], -1) & (np.abs(proxy.vertices[:, 1:]) < 0.99).all(axis=1)
    assert np.allclose(proxy.normals[cap], [-1, 0, 0])
    assert mesh.area_faces.min() > 0


def test_an_oblique_half_space_is_cut_by_the_box():
    normal = np.array([2.0, 1.0, 2.0]) / 3
    mesh = mesh_of(extract(half_space(tuple(normal), 0.0), 48))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4, rel=1e-3)


def test_a_field_that_is_inside_everywhere_is_the_box():
    for cells in (20, 64):
        proxy = extract(half_space((0.1, 0.0, 0.0), 1.0), cells)
        assert_closed(proxy)
        assert mesh_of(proxy).volume == pytest.approx(8, rel=1e-5)


def test_a_ball_that_only_bulges_out_of_one_face_is_capped():
    mesh = mesh_of(extract(ball(0.5, (0.8, 0.0, 0.0)), 64))
    height = 0.3  # of the cut-off cap
    volume = 4 / 3 * np.pi * 0.5**3 - np.pi * height**2 * (0.5 - height / 3)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume, rel=0.01)
    assert mesh.bounds[1, 0] == 1


def test_a_field_without_a_surface_says_what_to_do():
    with pytest.raises(SculptError, match="no surface"):
        extract(half_space((0.1, 0.0, 0.0), -1.0), 32)


def test_damaged_weights_say_what_to_do():
    with pytest.raises(SculptError, match="damaged"):
        extract(half_space((1.0, 0.0, 0.0), float("nan")), 32)


def test_progress_rises_and_can_cancel():
    seen = []
    extract(ball(), 64, lambda fraction, text: seen.append((fraction, text)))
    fractions = [fraction for fraction, _ in seen]
    assert fractions == sorted(fractions)
    assert fractions[0] >= 0 and fractions[-1] <= 1
    assert all(text for _, text in seen)

    def cancel(fraction, text):
        if fraction > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        extract(ball(), 64, cancel)


def test_arrays_have_the_types_that_blender_takes():
    proxy = extract(ball(), 32)
    assert (proxy.vertices.dtype, proxy.normals.dtype) == (np.float32, np.float32)
    assert proxy.triangles.dtype == np.int32
    assert proxy.triangles.flags.c_contiguous and proxy.vertices.flags.c_contiguous
