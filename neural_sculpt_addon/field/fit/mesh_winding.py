# SPDX-License-Identifier: GPL-3.0-or-later
"""Winding numbers of triangles, and which way closed pieces face when one lies in another.

The winding number (Barill et al., "Fast winding numbers for soups and clouds", 2018) counts how
often faces go around a point: 1 in a closed piece that faces outward, 0 outside, and smoothly in
between across a hole. A closed piece within a solid that faces inward is the wall of a cavity and
takes its inside away. Any space, but all arguments in the same.
"""

import igl
import numpy as np
from numpy.typing import NDArray

from ...common.progress import look
from ..geometry import face_normals, unit

Array = NDArray[np.float64]

FAST, CLOSE = 2.0, 3.0
"""Accuracy: a group of faces counts as one beyond so many of its radii. The number is off by 1e-3
at most, or by 2e-4 for twice the time, which films need to be smooth."""
PROBES_OF_PIECE = 16  # faces of a piece at which it is asked what encloses it
INWARD = 1e-5  # how far in its own inside they lie: pieces may touch, or share faces
DISSENT = 0.1  # share of the probes that may say otherwise: pieces may cross
DUPLICATE = np.int8(2)  # in place of the way that a piece faces: it lies upon another
SAME_PLACE = 1e-5  # distance between surfaces that lie upon each other,
SAME_VOLUME = 1e-4  # and difference of their volumes, by these


class Winding:
    """The winding number of faces as a function of points (N, 3) -> (N,)."""

    def __init__(self, vertices: Array, faces: NDArray[np.int64]) -> None:
        self._hierarchy = igl.FastWindingNumberBVH()
        self._hierarchy.init(vertices, faces, 2)

    def __call__(self, points: Array, accuracy: float = FAST) -> Array:
        """accuracy: FAST or CLOSE"""
        return np.asarray(self._hierarchy.winding_number(points, accuracy))


def facing(
    points: Array, faces: NDArray[np.int64], pieces: NDArray[np.int64], volumes: Array
) -> NDArray[np.int8]:
    """Which way closed pieces should face: 1 outward, -1 inward (P,); 0 for `volumes` of 0, and
    DUPLICATE for what lies upon another piece, however it is divided into faces.

    pieces:  the piece of each face (F,)
    volumes: of each piece as it is wound (P,): negative when it faces inward, 0 when it is open

    A piece that nothing encloses faces outward. When it did not, what lies in it is taken for
    inside out as well. A piece that others enclose, alone or together, stays as it is, unless it
    would take away an inside where there is none. Where only some of the others were inside out,
    its winding counts as it is given.
    """
    order = np.argsort(-np.abs(volumes), kind="stable")[: np.count_nonzero(volumes)]
    wound = np.sign(volumes).astype(np.int8)  # (P,)
    sorted_faces = faces[np.argsort(pieces, kind="stable")]
    counts = np.bincount(pieces, minlength=len(volumes))
    starts = np.concatenate([[0], np.cumsum(counts)])
    corners = points[sorted_faces]  # (F, 3, 3)
    low = np.minimum.reduceat(corners.min(axis=1), starts[:-1])  # (P, 3)
    high = np.maximum.reduceat(corners.max(axis=1), starts[:-1])
    spread = (np.arange(PROBES_OF_PIECE) + 0.5) / PROBES_OF_PIECE
    probed = corners[starts[:-1, None] + (spread * counts[:, None]).astype(int)]  # (P, 16, 3, 3)
    inward = -np.sign(volumes)[:, None, None] * unit(face_normals(probed))
    probes = probed.mean(axis=2) + INWARD * inward

    lows, highs = (np.ascontiguousarray(side[order].T) for side in (low, high))  # (3, P)
    result = np.zeros(len(volumes), np.int8)
    number = np.zeros((len(volumes), PROBES_OF_PIECE), np.int64)  # of what is larger, at the probes
    enclosed = np.zeros(number.shape, bool)  # which of the probes are
    votes = np.zeros((2, len(volumes)), np.int64)  # of pieces inside out, and of others
    for place, piece in enumerate(order):
        if result[piece] == DUPLICATE:
            continue
        look()
        around = np.quantile(number[piece], DISSENT, method="lower")
        agreed = votes[:, piece].min() <= DISSENT * votes[:, piece].sum()
        if agreed and enclosed[piece].mean() > 1 - DISSENT:
            right = votes[1, piece] > votes[0, piece]
        else:
            right = wound[piece] > 0
        kept = wound[piece] if right else -wound[piece]
        result[piece] = kept if around + kept >= 0 else 1
        smaller = slice(place + 1, None)
        near = lows[:, smaller] < high[piece, :, None]
        near &= highs[:, smaller] > low[piece, :, None]
        near = order[smaller][near.all(axis=0)]
        if not len(near):
            continue
        own = sorted_faces[starts[piece] : starts[piece + 1]]
        alike = np.abs(low[near] - low[piece]).max(axis=1) < SAME_PLACE
        alike &= np.abs(high[near] - high[piece]).max(axis=1) < SAME_PLACE
        alike &= np.abs(volumes[near]) > (1 - SAME_VOLUME) * abs(volumes[piece])
        for other in near[alike]:
            its = np.unique(sorted_faces[starts[other] : starts[other + 1]])
            if _are_upon(points[its], points, own):
                result[other] = DUPLICATE
        near = near[result[near] != DUPLICATE]
        inside = np.abs(Winding(points, own)(probes[near].reshape(-1, 3))) > 0.5
        inside = inside.reshape(-1, PROBES_OF_PIECE)
        number[near] += result[piece] * inside
        enclosed[near] |= inside
        votes[int(right), near] += inside.sum(axis=1)
    return result


def _are_upon(places: Array, points: Array, faces: NDArray[np.int64]) -> bool:
    """Whether places (N, 3) lie on a mesh."""
    tree = igl.AABB()
    tree.init(points, faces)
    square = np.asarray(tree.squared_distance(points, faces, places)[0])
    return bool(square.max() < SAME_PLACE**2)
