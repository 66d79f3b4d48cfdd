# SPDX-License-Identifier: GPL-3.0-or-later
"""Which way the pieces of a mesh face: wound consistently, closed ones outward or as walls of
cavities, open ones as their neighbours ask for. Model space.
"""

import heapq

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from ..geometry import face_normals
from .mesh_winding import DUPLICATE, facing

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

CLOSED = 0.35  # |sum of area vectors| / area, below which a piece encloses a volume
BULKY = 0.02  # volume / area^1.5, above which an open piece has an outer side; a sphere has 0.09
EVEN = 1e-9  # of votes, by the lengths of edges


def orient(points: Array, faces: Faces) -> tuple[Faces, NDArray[np.int64], int, int]:
    """Each piece wound consistently; the pieces (F,); faces turned; faces of pieces dropped, which
    lay upon others.

    The area vectors of a closed piece cancel, and the sign of its volume about its own centroid
    tells the outer side; half a sphere has 0.5, a sheet 1. Open pieces are turned so that where
    more than two faces meet, as many go one way as the other; else those that are bulky face
    outward, and those that enclose nothing keep the side that most of their area had.
    """
    wound, piece = (np.asarray(array) for array in igl.bfs_orient(faces))
    of_piece = csr_matrix((np.ones(len(faces)), (piece, np.arange(len(faces)))))  # (P, F)
    same = (wound == faces).all(axis=1)  # (F,)
    corners = points[wound]  # (F, 3, 3)
    vector = 0.5 * face_normals(corners)  # (F, 3)
    area = np.linalg.norm(vector, axis=1)  # (F,)
    whole = of_piece @ area  # (P,)
    center = (of_piece @ (area[:, None] * corners.mean(axis=1))) / whole[:, None]  # (P, 3)
    volume = of_piece @ np.sum((corners[:, 0] - center[piece]) * vector, axis=1) / 3  # (P,)
    given = np.where(of_piece @ np.where(same, area, -area) < 0, -1, 1)  # (P,), by most of its area
    closed = np.linalg.norm(of_piece @ vector, axis=1) < CLOSED * whole  # (P,)
    faced = facing(points, wound, piece, np.where(closed, given * volume, 0))
    bulky = np.abs(volume) > BULKY * whole**1.5
    turn = np.where(closed, np.sign(volume) * faced, 0)  # (P,)
    duplicate = closed & (faced == DUPLICATE)
    turn = np.where(duplicate, given, turn)
    asks = _asked_of_others(points, wound, piece, len(turn))
    turn = _balanced(asks, turn, np.where(bulky, np.sign(volume), 0), np.abs(volume))
    turn = _balanced(asks, turn, given, whole)
    turned = (turn < 0)[piece]  # (F,)
    wound = np.where(turned[:, None], wound[:, ::-1], wound)
    kept = ~duplicate[piece]
    piece = np.unique(piece[kept], return_inverse=True)[1].reshape(-1)
    flipped = int(np.sum((turned == same)[kept]))
    return np.ascontiguousarray(wound[kept]), piece, flipped, int(np.sum(~kept))


def _balanced(asks: csr_matrix, turn: Array, preferred: Array, size: Array) -> Array:
    """`turn` (P,), known where it is 1 or -1, decided for all pieces with a preference (P,).

    Around an edge of a solid as many faces go one way as the other. Where pieces meet, known ones
    ask the others for that (P, P), the more the longer the edges are. Pieces that are asked for
    what they prefer are decided first, the largest by `size` (P,) before others; pieces that are
    asked for the opposite are decided last.
    """
    turn = turn.copy()
    votes = asks @ turn  # (P,)
    free = np.flatnonzero((turn == 0) & (preferred != 0))
    waiting = [(-votes[piece] * preferred[piece], -size[piece], piece) for piece in free]
    heapq.heapify(waiting)
    while waiting:
        agreed, _, piece = heapq.heappop(waiting)
        if turn[piece] or -agreed != votes[piece] * preferred[piece]:
            continue  # it is known, or waits under another number
        clear = abs(votes[piece]) > EVEN
        turn[piece] = np.sign(votes[piece]) if clear else preferred[piece]
        row = slice(asks.indptr[piece], asks.indptr[piece + 1])
        for other, weight in zip(asks.indices[row], asks.data[row], strict=True):
            votes[other] += weight * turn[piece]
            if not turn[other] and preferred[other]:
                heapq.heappush(waiting, (-votes[other] * preferred[other], -size[other], other))
    return turn


def _asked_of_others(
    points: Array, faces: Faces, pieces: NDArray[np.int64], count: int
) -> csr_matrix:
    """How long the edges are along which pieces go opposite ways (P, P), less those along which
    they go the same way, where more than two faces meet."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])  # (3F, 2)
    key = np.sort(ends, axis=1) @ [len(points), 1]
    _, edge, many = np.unique(key, return_inverse=True, return_counts=True)
    crowded = np.flatnonzero((many > 2)[edge])
    ends = ends[crowded]
    way = np.where(ends[:, 0] < ends[:, 1], 1.0, -1.0)
    way *= np.sqrt(np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1))
    at = np.unique(edge[crowded], return_inverse=True)[1].reshape(-1)
    rows = csr_matrix(
        (way, (np.tile(pieces, 3)[crowded], at)), (count, int(at.max(initial=-1)) + 1)
    )
    asks = -(rows @ rows.T)
    asks.setdiag(0)
    asks.eliminate_zeros()
    return asks.tocsr()
