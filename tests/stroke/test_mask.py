# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks of strokes: interpolation, continuation, what is full, size, files, and bad ones."""

import base64
import json
import tracemalloc
import zlib

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.displacement import MASKED, displace
from neural_sculpt_addon.stroke.file import dump_strokes, parse_strokes
from neural_sculpt_addon.stroke.mask import FINEST_SPACING, MOST_NODES, Mask
from neural_sculpt_addon.stroke.path import make_path
from neural_sculpt_addon.stroke.stroke import Kind, Stroke

SPACING = 1 / 32
UP = np.array([0.0, 0, 1])


def ramp(x):
    """From 0 at x = -0.25 to 1 at x = 0.25, in steps of 1 / 255 at the nodes of the lattice."""
    return np.clip(np.rint(255 * (0.5 + 2 * np.asarray(x))) / 255, 0, 1)


def slab(masks=ramp):
    """A mask that depends on x, on all nodes near the plane z = 0."""
    axis = np.arange(16, 49)
    i, j, k = np.meshgrid(axis, axis, [31, 32, 33], indexing="ij")
    nodes = np.stack([i, j, k], axis=-1).reshape(-1, 3).astype(np.uint8)
    return Mask(SPACING, nodes, np.rint(255 * masks(nodes[:, 0] * SPACING - 1)).astype(np.uint8))


def plane(spacing, size=0.5, seed=0):
    """Points (N, 3) of the plane z = 0.01, about `spacing` apart and in no pattern."""
    axis = np.arange(-size, size, 0.8 * spacing)
    x, y = np.meshgrid(axis, axis)
    points = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.01)], axis=1)
    points[:, :2] += np.random.default_rng(seed).uniform(-0.2, 0.2, (x.size, 2)) * spacing
    return points


def straight(**given):
    """A stroke along X through the origin of the plane z = 0, and its path."""
    points = np.array([[-0.4, 0, 0], [0.4, 0, 0]])
    ways = np.linspace(points[0], points[1], 801)
    return Stroke(points, Brush(0.2, 0.1), **given), make_path(ways, np.tile(UP, (801, 1)))


def test_a_ramp_weakens_the_displacement_linearly():
    """From node to node the mask is a line, and so is the factor 1 - m at the middle of the path
    and beside it."""
    nodes = np.arange(-0.375, 0.376, SPACING)
    for share in (0.0, 0.25, 0.5, 0.75):
        x = nodes[:-1] + share * SPACING
        mask = (1 - share) * ramp(nodes[:-1]) + share * ramp(nodes[1:])
        points = np.stack([x, 0 * x + 0.05, 0 * x], axis=1)
        for kind in Kind:
            free, path = straight(kind=kind)
            masked, _ = straight(kind=kind, mask=slab())
            normals = np.tile(UP, (len(x), 1))
            whole = displace(free, path, points, normals)
            weak = displace(masked, path, points, normals)
            assert whole.amount.min() > 0.05
            np.testing.assert_allclose(weak.amount, whole.amount * (1 - mask), atol=1e-12)
            np.testing.assert_array_equal(weak.direction, whole.direction)


def test_what_is_masked_in_full_counts_as_beside_the_stroke():
    masked, path = straight(mask=slab(lambda x: np.float64(x >= 0)))
    points = np.array([[-0.1, 0, 0], [0.1, 0, 0], [0.1, 0.3, 0], [0.1, 0, 0]])
    found = displace(masked, path, points, [UP, UP, UP, -UP])
    np.testing.assert_allclose(found.amount, [0.1, 0, 0, 0], atol=1e-9)
    np.testing.assert_allclose(found.relative_distance, [0, MASKED, 1.5, np.inf], atol=1e-6)


def test_a_surface_is_held_with_its_mask():
    """A line comes out within the step of 1 / 255 and what the mean of a cell's points is off."""
    for seed in range(3):
        points = plane(SPACING, seed=seed)
        mask = Mask.of(points, 0.5 + points[:, 1], SPACING)
        asked = plane(0.007, 0.45)
        off = mask(asked) - (0.5 + asked[:, 1])
        assert np.abs(off).max() < 0.5 * SPACING
        assert np.abs(off).mean() < 0.1 * SPACING


def test_points_that_are_masked_in_full_are_kept_in_full():
    points = plane(SPACING)
    full = (points[:, 0] > 0.1) | (np.random.default_rng(1).uniform(size=len(points)) < 0.02)
    mask = Mask.of(points, full, SPACING)(points)
    np.testing.assert_array_equal(mask[full], 1)
    alone = np.sort(np.linalg.norm(points[:, None] - points[full], axis=2), axis=1)[:, 0]
    np.testing.assert_array_equal(mask[alone > 2 * np.sqrt(3) * SPACING], 0)


def test_it_is_continuous_everywhere_and_goes_on_off_the_surface():
    points = plane(SPACING)
    mask = Mask.of(points, points[:, 0] > 0, SPACING)
    random = np.random.default_rng(2)
    for _ in range(20):
        ends = random.uniform(-1, 1, (2, 3))
        values = mask(np.linspace(*ends, 20_001))
        assert values.min() >= 0
        assert values.max() <= 1
        assert np.abs(np.diff(values)).max() < 2 * np.linalg.norm(ends[1] - ends[0]) / 2e4 / SPACING
    above = points[::7] + 0.08 * UP  # as when a stroke beneath is muted
    left, right = points[::7, 0] < -0.15, points[::7, 0] > 0.15
    assert mask(above)[left].max() < 0.2
    assert mask(above)[right].min() > 0.8
    assert 0 < mask(np.array([[0, 0, 0.9]]))[0] < 1


def test_scattered_nodes_are_found_in_little_space():
    """Anywhere in the box, as a file may have them; with its own value at each node, and half of
    what is half a cell away, where nothing else is."""
    random = np.random.default_rng(6)
    nodes = np.unique(random.integers(0, 64, (MOST_NODES, 3)), axis=0)[::16] * 4
    nodes = np.minimum(nodes + 1, 255).astype(np.uint8)
    values = random.integers(0, 256, len(nodes)).astype(np.uint8)
    mask = Mask(FINEST_SPACING, nodes, values)
    places = nodes * FINEST_SPACING - 1
    np.testing.assert_allclose(mask(places), values / 255, atol=1e-9)
    beside = mask(places + FINEST_SPACING / 2 * np.array([1, 0, 0])) - values / 510
    assert beside.min() > -1e-9 and beside.max() < 0.5 + 1e-9  # the other half is of nodes farther
    corners = Mask(FINEST_SPACING, np.uint8([[0, 0, 0], [255, 255, 255]]), np.uint8([51, 255]))
    tracemalloc.start()
    np.testing.assert_allclose(corners([[-1, -1, -1]]), 0.2)
    assert tracemalloc.get_traced_memory()[1] < 20e6  # one number for each node would take 68
    tracemalloc.stop()


def test_masks_are_bounded_in_size():
    """A sphere with a fine mask on all of it takes a coarser lattice, and some kilobytes."""
    random = np.random.default_rng(3)
    points = random.normal(size=(200_000, 3))
    points *= 0.85 / np.linalg.norm(points, axis=1, keepdims=True)
    mask = Mask.of(points, 0.5 + 0.5 * np.sin(8 * points[:, 0]), FINEST_SPACING)
    assert len(mask.nodes) <= MOST_NODES
    assert len(json.dumps(mask.to_json())) < 60_000
    assert np.abs(mask(points) - 0.5 - 0.5 * np.sin(8 * points[:, 0])).mean() < 0.1


def test_the_widest_stroke_has_a_mask():
    """Whose spacing would be larger than that of any lattice."""
    points = plane(0.05, 0.9)
    mask = Mask.of(points, np.full(len(points), 0.2), 1.25)
    np.testing.assert_allclose(mask(points), 0.2, atol=1e-9)


def test_files_round_trip_to_the_bit():
    stroke, _ = straight(mask=slab(), mirror=frozenset("XY"))
    (again,) = parse_strokes(dump_strokes([stroke]))
    assert again == stroke
    assert again != straight(mask=slab(lambda x: 0 * x + 0.5), mirror=frozenset("XY"))[0]
    points = np.random.default_rng(4).uniform(-1, 1, (1000, 3))
    np.testing.assert_array_equal(again.mask(points), stroke.mask(points))
    assert "mask" not in straight()[0].to_json()


def test_mirror_images_find_the_mask_where_they_are():
    stroke, _ = straight(mask=slab(), mirror=frozenset("X"))
    assert all(copy.mask is stroke.mask for copy in stroke.copies())


def packed(rows):
    return base64.b64encode(zlib.compress(bytes(rows))).decode()


GOOD = {"spacing": 0.1, "nodes": packed([1, 2, 3, 4, 5, 6, 100, 200])}


def test_the_bytes_of_a_file_are_as_the_readme_says():
    mask = Mask.from_json(GOOD)
    np.testing.assert_array_equal(mask.nodes, [[1, 3, 5], [2, 4, 6]])
    np.testing.assert_allclose(
        mask(np.array([[-0.9, -0.7, -0.5], [-0.8, -0.6, -0.4]])), [100 / 255, 200 / 255]
    )


@pytest.mark.parametrize(
    "bad",
    [
        None,
        [],
        {},
        {"spacing": 0.1},
        {**GOOD, "more": 1},
        {**GOOD, "spacing": "0.1"},
        {**GOOD, "spacing": 0.001},
        {**GOOD, "spacing": 2.0},
        {**GOOD, "spacing": float("nan")},
        {**GOOD, "spacing": 10**400},
        {**GOOD, "nodes": 5},
        {**GOOD, "nodes": "ä"},
        {**GOOD, "nodes": "####"},
        {**GOOD, "nodes": ""},
        {**GOOD, "nodes": base64.b64encode(b"no zlib").decode()},
        {**GOOD, "nodes": GOOD["nodes"][:-8]},
        {**GOOD, "nodes": packed([])},
        {**GOOD, "nodes": packed([1, 2, 3])},
        {**GOOD, "nodes": packed(bytes(4 * MOST_NODES + 4))},
        {**GOOD, "nodes": packed(bytes(10**8))},
    ],
)
def test_what_is_no_mask_is_refused_in_a_sentence(bad):
    stroke = {"points": [[0, 0, 0.5]], "radius": 0.1, "intensity": 0.1, "mask": bad}
    with pytest.raises(SculptError, match="mask") as refused:
        Stroke.from_json(stroke)
    assert str(refused.value).endswith(".")
    assert len(str(refused.value)) < 300


def test_what_lies_outside_of_the_box_masks_its_border():
    mask = Mask.of([[1.3, 0, 0], [0.8, 0, 0]], [1, 0], 0.125)
    assert mask([[1, 0, 0], [0.8, 0, 0]]).tolist() == [1, 0]


def test_masks_are_told_apart_by_identity():
    """Arrays in them have no truth and no hash."""
    one, other = slab(), slab()
    assert one != other
    assert len({one, other, one}) == 2
