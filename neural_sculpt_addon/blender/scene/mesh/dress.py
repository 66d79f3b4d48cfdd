# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of a mesh, kept while a field is fitted to it and then given to the proxy of that
field."""

import time
from collections.abc import Generator
from dataclasses import dataclass, field, replace

import numpy as np
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from ....interaction.steps import finish
from ....worker.client import Message
from . import attributes
from .attributes import POINT, Attributes
from .carried import FORESEE_SECONDS
from .sources import MeshSurface, Sources

Vectors = NDArray[np.float32]


@dataclass(eq=False)
class Dress:
    """The attributes of a mesh, and its surface in the frame that a field is fitted in."""

    surface: MeshSurface
    given: Attributes
    _key: Vectors | None = None
    _steps: Generator[None, None, Attributes] | None = field(default=None, repr=False)
    _worn: Attributes | None = None

    @classmethod
    def of(cls, ob: Object, mesh: Mesh, vertices: Vectors, turned: bool) -> "Dress":
        """The dress of an object's mesh.

        vertices: (V, 3), as they are fitted
        turned:   whether that mirrors them, so that triangles are turned over
        """
        surface = MeshSurface.of(mesh, vertices)
        if turned:
            loops = surface.loops
            loops = np.arange(len(mesh.loops)).reshape(-1, 3) if loops is None else loops
            triangles = np.ascontiguousarray(surface.triangles[:, ::-1])
            surface = replace(surface, triangles=triangles, loops=loops[:, ::-1].copy())
        return cls(surface, finish(attributes.read(lambda: ob, lambda: mesh)))

    def foresee(self, result: Message) -> bool:
        """Work some milliseconds at what the proxy of a fit's result wears; whether there is more
        to do."""
        if self._key is not result.arrays["vertices"]:
            self._key, self._steps, self._worn = result.arrays["vertices"], self._find(result), None
        end = time.perf_counter() + FORESEE_SECONDS
        while self._worn is None and self._steps is not None and time.perf_counter() < end:
            try:
                next(self._steps)
            except StopIteration as found:
                self._worn = found.value
        return self._worn is None

    def worn(self, result: Message) -> Attributes | None:
        """The attributes of a result's proxy; what was not foreseen is found at once."""
        while self.foresee(result):
            pass
        return self._worn

    def _find(self, result: Message) -> Generator[None, None, Attributes]:
        """Find the attributes of a result's proxy, in steps."""
        wanted = {layer.domain for layer in self.given.layers.values()}
        if self.given.groups:
            wanted |= {POINT}
        center, scale = np.array(result.fields["center"]), result.fields["scale"]
        positions = ((self.surface.positions - center) / scale).astype(np.float32)
        sources = Sources(
            replace(self.surface, positions=positions),
            result.arrays["vertices"],
            result.arrays["triangles"],
            frozenset(wanted),
        )
        yield from sources.steps(self.given.layers)
        return (yield from sources.transfer(self.given))
