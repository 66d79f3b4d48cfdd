# SPDX-License-Identifier: GPL-3.0-or-later
"""A mask: how much of the surface a stroke leaves where it is, frozen when the stroke was drawn.

m = 0 lets a stroke displace in full, m = 1 keeps the surface as it is. Nodes of a lattice near the
surface under the stroke hold it; between them m is trilinear. Where nodes are missing, coarser and
coarser lattices of their means go on, so m is defined and continuous everywhere, and a surface that
lies a little elsewhere when strokes are replayed finds the mask, too. NumPy, model space.
"""

import base64
import binascii
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import reading
from ..common.errors import SculptError

Array = NDArray[np.float64]
Places = NDArray[np.intp]

MOST_NODES = 16384
FINEST_SPACING = 2 / 254  # so that the nodes 0 to 255 of each axis span the box
COARSEST_SPACING = 0.5
MASK_STEPS = 255  # from 0 to 1
MASK_BRICK = (
    4  # nodes along an edge: with fewer the table of bricks is larger, with more the bricks
)
FULL = 1 - 1e-6  # sums of weights that are 1 but for rounding
CORNERS = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), axis=-1).reshape(8, 3)


@dataclass(frozen=True, eq=False)
class Mask:
    """Masks at nodes of a lattice.

    spacing: of the lattice, model space
    nodes:   (M, 3), i of the place -1 + spacing i along each axis, 0 to 255
    values:  (M,), masks from 0 to 255
    """

    spacing: float
    nodes: NDArray[np.uint8]
    values: NDArray[np.uint8]

    def __post_init__(self) -> None:
        """Refuse a lattice that is too fine, too coarse, too large or empty. SculptError."""
        if not FINEST_SPACING <= self.spacing <= COARSEST_SPACING:
            raise SculptError(
                "The spacing of a stroke's mask is {}; it must lie between {} and {}.",
                f"{self.spacing:.6g}",
                f"{FINEST_SPACING:.6f}",
                COARSEST_SPACING,
            )
        if not 1 <= len(self.nodes) == len(self.values) <= MOST_NODES:
            raise SculptError("A stroke's mask needs 1 to {} nodes.", MOST_NODES)

    @staticmethod
    def of(points: ArrayLike, masks: ArrayLike, spacing: float) -> "Mask":
        """The mask of a surface, given at points (N, 3) of it as (N,) from 0 to 1, no farther apart
        than about `spacing`; it is doubled until the nodes are few enough.

        A node is the mean of the points around it, by trilinear weights; 1 beside a point that is
        masked in full, so that this one stays.
        """
        points, masks = np.asarray(points, float), np.asarray(masks, float)
        spacing = min(max(spacing, FINEST_SPACING), COARSEST_SPACING)
        while len((found := _spread(points, masks, spacing))[0]) > MOST_NODES:
            spacing *= 2
        nodes, means, full = found
        values = np.where(full, 1.0, means)
        return Mask(spacing, nodes.astype(np.uint8), np.rint(MASK_STEPS * values).astype(np.uint8))

    def __call__(self, points: ArrayLike) -> Array:
        """The mask (N,) at points (N, 3), from 0 to 1."""
        points = np.asarray(points, float)
        mask, free = np.zeros(len(points)), np.ones(len(points))
        for lattice in self._lattices:
            left = np.flatnonzero(free)
            if not len(left):
                break
            value, known = lattice(points[left])
            mask[left] += free[left] * value
            free[left] *= np.where(known > FULL, 0, 1 - known)
        mask += free * self.values.mean() / MASK_STEPS
        return np.where(mask > FULL, 1.0, mask)

    @cached_property
    def _lattices(self) -> "list[_Lattice]":
        """From fine to coarse; each holds the means of the one before."""
        spacing, nodes, values = self.spacing, self.nodes.astype(np.intp), self.values / MASK_STEPS
        lattices = [_Lattice(spacing, nodes, values)]
        while spacing < COARSEST_SPACING:
            points = nodes * spacing - 1
            spacing *= 2
            nodes, values, _ = _spread(points, values, spacing)
            lattices.append(_Lattice(spacing, nodes, values))
        return lattices

    @cached_property
    def _packed(self) -> str:
        rows = np.vstack([self.nodes.T, self.values])  # (4, M)
        return base64.b64encode(zlib.compress(rows.tobytes())).decode()

    def to_json(self) -> dict[str, Any]:
        """Plain data for a stroke file; nodes are base64 of zlib of the bytes of all i along X, Y
        and Z and of all values."""
        return {"spacing": self.spacing, "nodes": self._packed}

    @staticmethod
    def from_json(data: object) -> "Mask":
        """Read what `to_json` wrote. SculptError when it is something else."""
        if not isinstance(data, Mapping) or set(data) != {"spacing", "nodes"}:
            raise SculptError('A stroke\'s mask is {"spacing": ..., "nodes": ...}.')
        try:
            spacing = reading.number(data["spacing"])
            packed = base64.b64decode(reading.text(data["nodes"]), validate=True)
            unpacking = zlib.decompressobj()
            rows = unpacking.decompress(packed, 4 * MOST_NODES + 1)
        except (*reading.UNREADABLE, binascii.Error, zlib.error) as error:
            raise SculptError("A stroke's mask cannot be read ({}).", f"{error!s:.100}") from error
        if len(rows) % 4 or len(rows) > 4 * MOST_NODES or not unpacking.eof:
            raise SculptError(
                "A stroke's mask needs four bytes for each node, and at most {} nodes.", MOST_NODES
            )
        *nodes, values = np.frombuffer(rows, np.uint8).reshape(4, -1)
        return Mask(spacing, np.stack(nodes, axis=1), values)


class _Lattice:
    """Values at some nodes of a lattice, for trilinear interpolation.

    Nodes are found by way of bricks of MASK_BRICK^3 of them, of which only those in use take space.
    """

    def __init__(self, spacing: float, nodes: Places, values: Array) -> None:
        """nodes (M, 3), values (M,)"""
        self._spacing, self._low = spacing, nodes.min(axis=0) - 1
        nodes = nodes - self._low
        self._shape = nodes.max(axis=0) + 2  # with nothing all around
        self._bricks = (self._shape + MASK_BRICK - 1) // MASK_BRICK
        used, number = np.unique(_linear(nodes // MASK_BRICK, self._bricks), return_inverse=True)
        self._brick = np.zeros(self._bricks.prod(), np.int32)  # 0: not in use
        self._brick[used] = np.arange(1, len(used) + 1)
        self._row = np.zeros((len(used) + 1) * MASK_BRICK**3, np.int32)
        inside = _linear(nodes % MASK_BRICK, np.full(3, MASK_BRICK))
        self._row[(number.ravel() + 1) * MASK_BRICK**3 + inside] = np.arange(1, len(nodes) + 1)
        self._values = np.append(0.0, values)

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Sums (N,) of weighted values at points (N, 3), and of the weights of existing nodes."""
        place = np.clip((points + 1) / self._spacing - self._low, 0, self._shape - 1)
        cell = np.minimum(place.astype(np.intp), self._shape - 2)
        (x, y, z), inside = np.divmod(cell.T[:, None] + [[0], [1]], MASK_BRICK)  # each (2, N)
        x, y = x * (self._bricks[1] * self._bricks[2]), y * self._bricks[2]
        inside *= np.reshape([MASK_BRICK**2, MASK_BRICK, 1], (3, 1, 1))
        value, known = np.zeros((2, len(points)))
        for (i, j, k), weight in zip(CORNERS, _weights(place - cell), strict=True):
            brick = self._brick[x[i] + y[j] + z[k]]
            row = self._row[brick * MASK_BRICK**3 + inside[0, i] + inside[1, j] + inside[2, k]]
            value += weight * self._values[row]
            known += weight * (row > 0)
        return value, known


def _spread(
    points: Array, values: Array, spacing: float
) -> tuple[Places, Array, NDArray[np.bool_]]:
    """Values (N,) of points (N, 3) spread over a lattice.

    Given back are the nodes (M, 3) of all cells in which points lie, the means (M,) of the values
    by trilinear weights, and which nodes (M,) have a value of 1 beside them.
    """
    place = (np.clip(points, -1, 1) + 1) / spacing
    cell = place.astype(np.intp)
    low = cell.min(axis=0)
    shape = cell.max(axis=0) - low + 2
    at = _linear(CORNERS, shape)[:, None] + _linear(cell - low, shape)  # (8, N)
    weights = np.stack(_weights(place - cell))
    reached = np.zeros(shape.prod(), bool)
    reached[at[weights > 0]] = True
    index = np.flatnonzero(reached)
    row = np.zeros(len(reached), np.int32)
    row[index] = np.arange(len(index))
    at = row[at]
    sums = (np.bincount(at.ravel(), w.ravel(), len(index)) for w in (weights * values, weights))
    full = np.zeros(len(index), bool)
    full[at[(weights > 0) & (values >= 1)]] = True
    return np.stack(np.unravel_index(index, shape), axis=1) + low, np.divide(*sums), full


def _linear(places: Places, shape: Places) -> Places:
    """Numbers (N,) of places (N, 3) in an array of that shape."""
    return (places[:, 0] * shape[1] + places[:, 1]) * shape[2] + places[:, 2]


def _weights(inside: Array) -> list[Array]:
    """Trilinear weights (N,) of each corner of a cell at places (N, 3) in [0, 1] in it."""
    x, y, z = ((1 - t, t) for t in inside.T)
    return [x[i] * y[j] * z[k] for i, j, k in CORNERS]
