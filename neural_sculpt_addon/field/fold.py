# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a displaced surface runs through itself, and which parts of it bound nothing then.

A surface that is displaced farther than it is curved folds over; one that is displaced farther than
a wall is thick comes out behind it; the sides of a groove meet. Samples show it by themselves
(`crossings`); which parts bound nothing then, winding numbers tell (Jacobson et al., "Robust
inside-outside segmentation using generalized winding numbers", 2013): those of the shape before,
and of the volume between tubes and their targets, added or taken away. Just outside of what bounds
the shape they are 0. Model space. See docs/method.md, section 2.
"""

from collections.abc import Sequence

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_opening

from ..stroke.progress import Check
from .evaluate import values
from .field import Field
from .nearest import search_tree
from .surface import Samples
from .threads import SEARCHED, in_pieces
from .tube import Tube

WRONG_SIDE = 2e-3  # of f0, which may be as far off the surface that was asked for
CLOSE = 0.9  # of a displacement; the rest is for samples that are not everywhere
BESIDE = 1e-3  # how far outside of a sample the winding number is taken
ROUNDING = 1e-6  # of places and normals in single precision
BOUND = 0.5  # |winding numbers| below count as 0
ORDER, REACH = 2, 2.0  # of their series, and from how many radii of a part it stands for that
FEW = 32  # points at a time: where a stroke lies many times upon itself, each takes up to 4 ms


def crossings(field: Field, before: Samples, after: Samples, check: Check) -> NDArray[np.bool_]:
    """Which samples (N,) have run through the surface `before` or `after`, as they show themselves.

    Carved ones come out on the other side of a wall, raised ones run into another part. Others come
    closer to some part than it is displaced itself, or are turned over.
    """
    if not len(before.points):
        return np.zeros(0, bool)
    way = after.points - before.points
    outward = np.sign((way * before.normals).sum(axis=1))
    over = _turned_over(before, after)
    far = np.linalg.norm(way, axis=1)
    tree = search_tree(before.points)

    def is_through(part: slice) -> NDArray[np.bool_]:
        return outward[part] * values(field, after.points[part]) < -WRONG_SIDE

    def is_close(part: slice) -> NDArray[np.bool_]:
        distance, nearest = tree.query(after.points[part])
        return distance < CLOSE * far[nearest]

    through = in_pieces(is_through, len(far), check)
    return through | over | in_pieces(is_close, len(far), check, size=SEARCHED)


class SweptVolume:
    """The volume between tubes and their targets: +1 where it is added, -1 where it is carved.

    It is the sum of the winding numbers of either half of its surface: a tree of all of it takes
    50 ms to make, in which no cancel is heard.
    """

    def __init__(self, tubes: Sequence[Tube], check: Check) -> None:
        """Close the gap between each tube and its targets by walls along its rim."""
        self._check = check
        nothing = np.full((1, 3), 2.0), np.zeros((1, 3), np.int64)  # igl takes no empty mesh
        vertices, faces, count = [nothing[0]], [nothing[1]], 1
        for tube in tubes:
            size, top = len(tube.surface.points), tube.triangles()
            rim = _rim(top)
            start, end = rim.T
            walls = (end, start, start + size), (end, start + size, end + size)
            bottom = top[:, ::-1] + size
            faces += [count + part for part in (top, bottom, *(np.stack(w, 1) for w in walls))]
            vertices += [tube.target.points, tube.surface.points]
            count += 2 * size
        places, self._trees = np.concatenate(vertices).astype(float), []
        for half in filter(len, np.array_split(np.concatenate(faces), 2)):
            check()
            self._trees.append(igl.FastWindingNumberBVH())
            self._trees[-1].init(places, half, ORDER)

    def winding(self, points: NDArray[np.float32]) -> NDArray[np.float64]:
        """Winding numbers (N,) at points (N, 3)."""

        def wind(part: slice) -> NDArray[np.float64]:
            place = points[part].astype(float)
            halves = [np.asarray(half.winding_number(place, REACH)) for half in self._trees]
            return np.sum(halves, axis=0)

        return in_pieces(wind, len(points), self._check, light=True, size=FEW)


def lost(field: Field, swept: SweptVolume, tube: Tube, check: Check) -> NDArray[np.bool_]:
    """Which targets (N,) of a tube bound nothing: those that face inward, or are buried, so that
    just outside of them is no outside."""
    outside = tube.target.points + BESIDE * tube.target.normals
    shape = in_pieces(lambda part: values(field, outside[part]) < 0, len(outside), check)
    buried = np.abs(shape + swept.winding(outside)) > BOUND
    buried |= _turned_over(tube.surface, tube.target)
    left = np.append(~buried, False)[tube.grid]  # (rows, columns)
    left = np.asarray(binary_opening(left, np.ones((2, 2))), bool)  # single samples bound nothing
    gone = np.ones(len(buried), bool)
    gone[tube.grid[left]] = False
    return gone


def _turned_over(before: Samples, after: Samples) -> NDArray[np.bool_]:
    """Which samples (N,) of a displaced surface face against the way that they went outward."""
    way = after.points - before.points
    outward = np.sign((way * before.normals).sum(axis=1))
    return outward * (way * after.normals).sum(axis=1) < -ROUNDING


def _rim(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Edges (E, 2) that have a triangle on one side only, in its direction."""
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])  # (3 T, 2)
    size = edges.max(initial=0) + 1
    there, back = size * edges[:, 0] + edges[:, 1], size * edges[:, 1] + edges[:, 0]
    return edges[~np.isin(there, back)]
