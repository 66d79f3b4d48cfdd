# SPDX-License-Identifier: GPL-3.0-or-later
"""Display of strokes by one mesh: their shape as far as it is computed, and what the mesh shows."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from bpy.types import Object
from numpy.typing import NDArray

from ....interaction.displaced import Displaced
from ....stroke.stroke import Stroke
from . import preview_attributes, proxy_mesh


@dataclass
class PreviewDisplay:
    """Strokes that one mesh shows, or will soon.

    true:    the mesh's own values, by the attributes that a preview changes
    written: vertices (V, 3) as the display has put them
    todo:    strokes that are still to be added to the shape
    seen:    strokes of the shape that the mesh shows
    """

    mesh: int  # its session_uid
    shape: Displaced
    true: Mapping[str, NDArray[np.float32]]
    written: NDArray[np.float32]
    todo: tuple[Stroke, ...] = ()
    seen: tuple[Stroke, ...] = ()

    @staticmethod
    def begin(ob: Object, shape: Displaced, todo: tuple[Stroke, ...]) -> "PreviewDisplay":
        """A display on the object's mesh as it is now, which `shape` was made of."""
        mesh = proxy_mesh.mesh_of(ob)
        true = preview_attributes.own(mesh)
        return PreviewDisplay(mesh.session_uid, shape, true, true["position"], todo)

    @property
    def strokes(self) -> tuple[Stroke, ...]:
        """The strokes that the mesh shows, or will soon."""
        return *self.shape.strokes, *self.todo

    @property
    def is_begun(self) -> bool:
        """Whether the mesh has been changed, and carries its own values. It gets them then and not
        at the press, for that takes some milliseconds."""
        return self.written is not self.true["position"]

    @property
    def is_whole(self) -> bool:
        """Whether the mesh shows all its strokes."""
        return self.seen is self.shape.strokes and not self.todo

    def advance(self, most: int | None = None) -> None:
        """Displace by the strokes until some `most` vertices were looked at."""
        looked = self.shape.advance(most)
        while self.todo and (most is None or looked < most):
            self.shape.begin(self.todo[0])
            self.todo = self.todo[1:]
            looked += self.shape.advance(None if most is None else most - looked)

    def show(self, ob: Object) -> None:
        """Write what the shape has become since into the object's mesh; some 1 ms, and the first
        time more, see `is_begun`."""
        shape, mesh = self.shape, proxy_mesh.mesh_of(ob)
        if self.seen is shape.seen and self.seen:
            return
        if len(vertices := shape.vertices):  # otherwise the mesh is what it was
            if not self.is_begun:
                preview_attributes.keep(mesh, self.true)
            self.written = preview_attributes.put(
                mesh, self.true, vertices, shape.positions, shape.normals
            )
        self.seen = shape.seen

    def is_untouched(self, ob: Object) -> bool:
        """Whether the object's mesh still is as it was shown."""
        mesh = proxy_mesh.mesh_of(ob)
        if mesh.session_uid != self.mesh or mesh.is_editmode:
            return False
        if preview_attributes.is_previewed(mesh) != self.is_begun:
            return False
        return preview_attributes.is_as_put(mesh, self.written)
