# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers as bytes: the coefficients of one layer, or of a whole detail, packed small.

    magic | zlib( for each level, rising: level (uint8), count (uint32), gaps, values )

Coefficients are whole multiples of UNIT and are stored as these whole numbers, zigzag (0, -1, 1
become 0, 1, 2), node indices as the gaps between them. Both are uint32 in byte planes: all lowest
bytes first, all highest last. A stroke takes 2.6 bytes a coefficient. The same coefficients give
the same bytes. Bytes come from outside and are untrusted: what they unpack to is bounded and
checked.
"""

import struct
import zlib
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..common.errors import SculptError
from .levels import BRICK, COARSEST, FINEST, UNIT, Coefficients, Level, cells_per_axis, places

MAGIC = b"NSL\x01"  # the last byte is the version
MOST_COEFFICIENTS = 1 << 23  # of all levels: 64 MiB unpacked
MOST_BRICKS = 1 << 18  # that they make: 1 GiB when evaluated
MOST_UNITS = 1 << 24  # of |coefficient|: what float32 adds exactly
_HEAD = struct.Struct("<BI")
_PLANES = 4  # bytes of a number


def layer_to_bytes(coefficients: Coefficients) -> bytes:
    """The bytes of `coefficients`; levels without nodes are left out.

    SculptError when they are more than `layer_from_bytes` would read.
    """
    parts, bricks = [], 0
    for level, part in sorted(coefficients.items()):
        if not len(part.index):
            continue
        index = part.index.astype(np.int64)
        exact = part.values.astype(np.float64) / UNIT
        if not np.array_equal(exact, np.rint(exact)) or np.isinf(exact).any():
            raise SculptError("This layer's coefficients are no multiples of their unit.")
        units = exact.astype(np.int64)
        bricks += _checked(level, index, units)
        parts.append(_HEAD.pack(level, len(index)))
        parts += map(_planes, (np.diff(index, prepend=-1) - 1, units << 1 ^ units >> 63))
    data = b"".join(parts)
    _bound(len(data), bricks)
    return MAGIC + zlib.compress(data)


def layer_from_bytes(data: bytes) -> Coefficients:
    """The coefficients that `layer_to_bytes` wrote. SculptError when the bytes hold none."""
    magic, packed = data[: len(MAGIC)], data[len(MAGIC) :]
    if magic[:-1] != MAGIC[:-1]:
        raise SculptError("These bytes are no layer of Neural Sculpt.")
    if magic != MAGIC:
        raise SculptError(
            "This layer was written in format version {}, this add-on reads version {}."
            " Update Neural Sculpt to open it.",
            magic[-1],
            MAGIC[-1],
        )
    raw = _unpacked(packed)
    coefficients, place, bricks, last = {}, 0, 0, COARSEST - 1
    while place < len(raw):
        if len(raw) - place < _HEAD.size:
            raise SculptError("This layer is cut off; it is damaged.")
        level, count = _HEAD.unpack_from(raw, place)
        place += _HEAD.size
        size = _PLANES * count
        if not last < level <= FINEST or not 0 < 2 * size <= len(raw) - place:
            raise SculptError("This layer's levels do not fit what follows; it is damaged.")
        gaps, zigzag = (_numbers(raw[at : at + size]) for at in (place, place + size))
        place, last = place + 2 * size, level
        index = np.cumsum(gaps + 1) - 1
        units = zigzag >> 1 ^ -(zigzag & 1)
        bricks += _checked(level, index, units)
        _bound(0, bricks)
        coefficients[level] = Level(index.astype(np.int32), (units * UNIT).astype(np.float32))
    return coefficients


def _unpacked(packed: bytes) -> bytes:
    """What zlib packed; never more than a layer can be."""
    unpacking = zlib.decompressobj()
    try:
        raw = unpacking.decompress(packed, _MOST_BYTES + 1)
    except zlib.error as error:
        raise SculptError("This layer cannot be unpacked; it is damaged.") from error
    _bound(len(raw), 0)
    if not unpacking.eof or unpacking.unused_data:
        raise SculptError("This layer is cut off or goes on after its end; it is damaged.")
    return raw


_MOST_BYTES = 2 * _PLANES * MOST_COEFFICIENTS + _HEAD.size * (FINEST - COARSEST + 1)


def _bound(size: int, bricks: int) -> None:
    if size > _MOST_BYTES or bricks > MOST_BRICKS:
        raise SculptError("This detail is larger than any field's: 8 million coefficients.")


def _checked(level: int, index: NDArray[np.int64], units: NDArray[np.int64]) -> int:
    """How many bricks the nodes of a level make. SculptError when they cannot be of that level."""
    if not COARSEST <= level <= FINEST:
        raise SculptError(
            "This layer has the level {}; there are {} to {}.", level, COARSEST, FINEST
        )
    n = cells_per_axis(level)
    if (np.diff(index, prepend=-1) <= 0).any() or index[-1] >= n**3:
        raise SculptError("This layer's nodes do not rise or lie off the grid; it is damaged.")
    cells = places(index.astype(np.int32), level)
    if cells.min() < 1 or cells.max() > n - 2:  # whose neighbours would lie off the grid
        raise SculptError("This layer's nodes lie on the border of the grid; it is damaged.")
    if np.abs(units).max() > MOST_UNITS:
        raise SculptError("This layer's coefficients are beyond {}.", f"{MOST_UNITS * UNIT:g}")
    size = n // BRICK
    made = np.zeros(size**3, bool)
    # A node at the border of a brick is in its neighbour's halo, too.
    ends = [(cells + side) // BRICK * np.array([size * size, size, 1]) for side in (-1, 1)]
    for x, y, z in product(*zip(*(end.T for end in ends), strict=True)):
        made[x + y + z] = True
    return np.count_nonzero(made)


def _planes(numbers: NDArray[np.int64]) -> bytes:
    return numbers.astype("<u4").view(np.uint8).reshape(-1, _PLANES).T.tobytes()


def _numbers(planes: bytes) -> NDArray[np.int64]:
    stacked = np.frombuffer(planes, np.uint8).reshape(_PLANES, -1)
    return np.ascontiguousarray(stacked.T).view("<u4")[:, 0].astype(np.int64)
