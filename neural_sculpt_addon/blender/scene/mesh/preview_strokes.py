# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that a preview is to show, and what they make of meshes. By session_uid of the object; no
mesh of Blender's is changed here."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ....interaction.displaced import Displaced
from ....stroke.stroke import Stroke
from . import proxy_mesh


class WantedStrokes:
    """The strokes that objects are to show: those that wait for their results and, last of all, the
    one under the pen."""

    def __init__(self) -> None:
        """There are none."""
        self.waiting: dict[int, tuple[Stroke, ...]] = {}
        self._drawn: tuple[int, Stroke] | None = None

    @property
    def targets(self) -> set[int]:
        """The objects that are to show any."""
        return {*self.waiting} if self._drawn is None else {*self.waiting, self._drawn[0]}

    def drawn_on(self, target: int) -> Stroke | None:
        """The stroke under the pen, if it is on this object."""
        return self._drawn[1] if self._drawn is not None and self._drawn[0] == target else None

    def draw(self, target: int, stroke: Stroke) -> None:
        """The stroke under the pen is on this object, and is like this now."""
        self._drawn = target, stroke

    def let_go(self) -> None:
        """No stroke is under the pen."""
        self._drawn = None


class StrokeShapes:
    """The meshes of objects, displaced by strokes. They are kept so that each stroke is displaced
    once: to show one takes some 10 ms."""

    def __init__(self) -> None:
        """None is known yet."""
        self._shapes: dict[int, tuple[int, Displaced]] = {}  # with the mesh's fingerprint

    def of(
        self,
        target: int,
        positions: NDArray[np.float32],
        triangles: NDArray[np.int32],
        strokes: Sequence[Stroke],
    ) -> Displaced:
        """A mesh (V, 3), (F, 3) displaced by the first strokes, as many as were added already. The
        last of these may have grown since."""
        mesh = proxy_mesh.fingerprint(positions)
        known = self._shapes.get(target)
        if known and known[0] == mesh and 0 < (count := len(known[1].strokes)) <= len(strokes):
            shape = known[1]
            if shape.strokes[:-1] == tuple(strokes[: count - 1]):
                if shape.strokes[-1] != strokes[count - 1]:
                    shape.change(strokes[count - 1])
                return shape
        shape = Displaced(positions, triangles)
        self._shapes[target] = mesh, shape
        return shape

    def keep(self, targets: Iterable[int]) -> None:
        """Forget the shapes of all objects but these."""
        kept = {*targets}
        self._shapes = {target: each for target, each in self._shapes.items() if target in kept}


def listed(strokes: Mapping[int, Sequence[Stroke]]) -> dict[int, tuple[Stroke, ...]]:
    """A copy that does not change."""
    return {target: tuple(each) for target, each in strokes.items()}
