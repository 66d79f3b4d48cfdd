# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers as bytes: exact round trips, small, and bytes that mean harm."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.checkpoint import layer_from_bytes, layer_to_bytes
from neural_sculpt_addon.field.detail import Detail
from neural_sculpt_addon.field.levels import FINEST, Level, cells_per_axis, linear
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.solve import local
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.random_layers import UNIT, layers, random_layer, same

MAGIC = b"NSL\x01"
PLACE = int(linear(np.array([[20, 20, 20]], np.int32), 5)[0])


def level(values, index=None, number=5):
    """A layer of one level, its nodes in a row."""
    values = np.array(values, np.float32)
    index = PLACE + np.arange(len(values)) if index is None else index
    return {number: Level(np.array(index, np.int32), values)}


def planes(numbers):
    """Numbers as the module's docstring describes them."""
    return b"".join(bytes(n >> 8 * k & 255 for n in numbers) for k in range(4))


def packed(*parts):
    """Bytes of parts (level, gaps, zigzag numbers), packed by hand."""
    return MAGIC + zlib.compress(
        b"".join(struct.pack("<BI", k, len(a)) + planes(a) + planes(b) for k, a, b in parts)
    )


def refused(data, match=None):
    with pytest.raises(SculptError, match=match) as caught:
        layer_from_bytes(data)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


@settings(deadline=None, max_examples=100)
@given(layers())
def test_round_trips_bit_by_bit(layer):
    data = layer_to_bytes(layer)
    read = layer_from_bytes(data)
    assert same(read, layer)
    assert layer_to_bytes(read) == data
    for part in read.values():
        assert part.index.dtype == np.int32 and part.values.dtype == np.float32
    Detail.of(read)  # every layer that is read can be evaluated


def test_the_format_is_what_the_module_says():
    layer = level([0, -UNIT, UNIT, 2.0], [PLACE, PLACE + 1, PLACE + 4, PLACE + 260])
    data = packed((5, [PLACE, 0, 2, 255], [0, 1, 2, 2**24]))
    assert same(layer_from_bytes(data), layer)
    assert zlib.decompress(layer_to_bytes(layer)[4:]) == zlib.decompress(data[4:])


def test_no_layer_and_levels_without_nodes():
    assert layer_from_bytes(layer_to_bytes({})) == {}
    empty = Level(np.empty(0, np.int32), np.empty(0, np.float32))
    part = random_layer(0, levels=(6,))
    assert same(layer_from_bytes(layer_to_bytes({5: empty, **part})), part)


@pytest.mark.parametrize("radius", [0.03, 0.08, 0.15])
def test_a_hundred_strokes_are_small(ready, radius):
    """A stroke takes less than 3 bytes a coefficient: 100 of 20,000 take less than 8 MB."""
    turn = np.linspace(0, 1.5, 9)
    points = 0.6 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    layer = local.LocalEdit(pose(ready, Stroke(points, Brush(radius, 0.04)))).solve()
    data = layer_to_bytes(layer)
    assert same(layer_from_bytes(data), layer)
    assert len(data) < 3 * sum(len(part.index) for part in layer.values()) + 100


@settings(deadline=None, max_examples=300)
@given(st.data())
def test_any_damage_is_a_layer_or_a_sculpt_error(data):
    """Damage to the packed bytes, and to what they unpack to, which no checksum protects."""
    good = layer_to_bytes(random_layer(0, count=20))
    inside = data.draw(st.booleans())
    whole = bytearray(zlib.decompress(good[4:]) if inside else good)
    place = data.draw(st.integers(0, len(whole) - 1) | st.integers(0, 12))
    damage = data.draw(st.binary(min_size=1, max_size=8))
    whole[place : place + data.draw(st.integers(0, 8))] = damage
    try:
        layer = layer_from_bytes(MAGIC + zlib.compress(whole) if inside else bytes(whole))
    except SculptError as error:
        assert "\n" not in str(error)
        return
    detail = Detail.of(layer)
    for number, part in detail.coefficients.items():
        kept = layer[number].values != 0
        np.testing.assert_array_equal(part.index, layer[number].index[kept])
        np.testing.assert_array_equal(part.values, layer[number].values[kept])


@settings(deadline=None)
@given(st.binary(max_size=200))
def test_noise(data):
    refused(data)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.1, 0.5, 0.9, 0.999])
def test_cut_off(share):
    data = layer_to_bytes(random_layer(0))
    refused(data[: int(share * len(data))])


def test_layers_that_go_on_after_their_end():
    refused(layer_to_bytes(random_layer(0)) + b"\0", "after its end")


def test_a_newer_version():
    refused(b"NSL\x02" + zlib.compress(b""), "version 2.*Update Neural Sculpt")


def test_a_bomb_is_not_unpacked():
    pump = zlib.compressobj(9)
    parts = [pump.compress(bytes(1 << 20)) for _ in range(200)]
    data = MAGIC + b"".join(parts) + pump.flush()
    assert len(data) < 1 << 20
    refused(data, "8 million")


def test_few_bytes_that_would_make_many_bricks():
    """Nodes at the corners of eight bricks each: a few kilobytes for more than 1 GiB of bricks."""
    n = cells_per_axis(FINEST)
    cells = np.stack(np.meshgrid(*[np.arange(8, n - 8, 24)] * 3, indexing="ij"), -1)
    index = linear(cells.reshape(-1, 3).astype(np.int32), FINEST)
    with pytest.raises(SculptError, match="larger than any field's"):
        layer_to_bytes({FINEST: Level(index, np.full(len(index), UNIT, np.float32))})
    gaps = np.diff(index, prepend=-1) - 1
    refused(packed((FINEST, gaps.tolist(), [2] * len(gaps))), "larger than any field's")


BAD = {
    "a level too coarse": [(1, [PLACE], [0])],
    "a level too fine": [(10, [PLACE], [0])],
    "a level twice": [(5, [PLACE], [0])] * 2,
    "levels that fall": [(6, [PLACE], [0]), (5, [PLACE], [0])],
    "a level without nodes": [(5, [], [])],
    "a node off the grid": [(5, [cells_per_axis(5) ** 3], [0])],
    "nodes beyond 32 bits": [(5, [2**32 - 1] * 9, [0] * 9)],
    "a node on the border": [(5, [0], [0])],
    "a node on another border": [(5, [PLACE - 20], [0])],
    "a value too large": [(5, [PLACE], [2**25 + 2])],
    "a value too low": [(5, [PLACE], [2**32 - 1])],
}


@pytest.mark.parametrize("parts", BAD.values(), ids=BAD)
def test_parts_that_cannot_be(parts):
    refused(packed(*parts))


def test_counts_that_lie():
    for count in (1, 3, 2**32 - 1):
        body = struct.pack("<BI", 5, count) + planes([PLACE, 0]) + planes([1, 1])
        refused(MAGIC + zlib.compress(body))
    refused(MAGIC + zlib.compress(b"\5\1"))


@pytest.mark.parametrize(
    "layer",
    [
        level([np.nan]),
        level([np.inf]),
        level([UNIT / 2]),
        level([8.0]),
        level([0.5, 0.5], [PLACE, PLACE]),
        level([0.5, 0.5], [PLACE, PLACE - 1]),
        level([0.5], [-5]),
        level([0.5], number=11),
    ],
)
def test_what_could_not_be_read_is_not_written(layer):
    with pytest.raises(SculptError):
        layer_to_bytes(layer)
