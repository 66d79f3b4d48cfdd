# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of a proxy, carried to the proxy that takes its place.

Each vertex gets the mask of the nearest vertex before, each face the face set of the nearest face,
and is hidden if that was; colors, UV maps, materials and vertex groups come from the closest point
(`sources`). Where a stroke has left the proxy alone both meshes are the same, and values stay
exact, however many strokes follow. A proxy without attributes costs nothing. Model space.
"""

import time
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from .. import sculpt_steps
from ..properties import found
from ..sculpt_steps import Step
from . import attributes, brush_attributes
from .attributes import FACE, Attributes
from .brush_attributes import FACE_SET, HIDDEN_EDGE, HIDDEN_FACE, HIDDEN_VERTEX, MASK
from .proxy_mesh import Geometry, corners_of, mesh_of
from .sources import VERTEX, MeshSurface, Sources

Vectors = NDArray[np.float32]
Painted = Mapping[str, NDArray[Any]]

FORESEE_SECONDS = 0.005  # seconds that `foresee` works in


@dataclass(eq=False)
class _Foreseen:
    """Attributes of a mesh that will come, found ahead of time.

    key:    the vertices of that mesh, the array itself and not one that is equal
    step:   the step of Blender's history at which the mesh of now was read; None where nothing
            hangs on it but what brushes painted, or the history cannot be read
    result: the attributes of the mesh that will come, when all of them are found
    """

    key: Vectors
    sources: Sources
    step: Step | None
    result: Attributes | None = None
    is_whole: bool = False

    def __post_init__(self) -> None:
        self._steps: Generator[None, None, None] | None = None

    def work(self, target: int, seconds: float) -> None:
        """Find some more, for the object with this session_uid."""
        end = time.perf_counter() + seconds
        self._steps = self._steps or self.find(target)
        while not self.is_whole and time.perf_counter() < end:
            self.is_whole = next(self._steps, True) is True

    def stop(self) -> None:
        """End unfinished work, which would stay in memory until garbage is collected."""
        if self._steps is not None:
            self._steps.close()

    def find(self, target: int) -> Generator[None, None, None]:
        """Find all of them, in steps."""
        if not _keeps(found(target)):
            yield from self.sources.steps({})
            return
        before = yield from attributes.read(lambda: found(target), lambda: mesh_of(found(target)))
        yield from self.sources.steps(before.layers)
        self.result = yield from self.sources.transfer(before)


_foreseen: list[_Foreseen] = []
"""One at most."""


def foresee(
    ob: Object, positions: Callable[[], Vectors], vertices: Vectors, triangles: NDArray[np.int32]
) -> bool:
    """Work for a few milliseconds at what `carried` will need for a mesh that comes; whether there
    is more to do. Calls about the same mesh give the same array of vertices.

    positions:           gives the vertices (V, 3) of the object's mesh as it is
    vertices, triangles: (N, 3), (T, 3) of the one that comes, checked
    """
    ready = next((each for each in _foreseen if each.key is vertices), None)
    step = _step(ob)
    if ready is None or ready.is_whole or ready.step != step:
        sources = _asked(ob, _painted(mesh_of(ob)), positions, vertices, triangles)
        if sources is None or (
            ready is not None and ready.step == step and ready.sources.is_as(sources)
        ):
            return False
        forget()
        _foreseen.append(_Foreseen(vertices, sources, step))
        return True
    ready.work(ob.session_uid, FORESEE_SECONDS)
    return True


def forget() -> None:
    """Nothing comes any more."""
    for each in _foreseen:
        each.stop()
    _foreseen.clear()


def carried(
    ob: Object, positions: Callable[[], Vectors], new: Geometry
) -> tuple[Painted, Attributes | None]:
    """The attributes of an object's mesh as `new` will have them: painted by brushes, and others.

    Attributes that say nothing, a mask of zeros for example, are left out.

    positions: gives the vertices (V, 3) of the mesh, if they are needed

    Of a whole new mesh of 250,000 triangles it takes up to a second or two, unless it was foreseen.
    """
    mesh, painted = mesh_of(ob), {}
    given = _painted(mesh)
    after, triangles = new.vertices.reshape(-1, 3), new.corners.reshape(-1, 3)
    sources = _asked(ob, given, positions, after, triangles)
    if sources is None:
        return {}, None
    ready = next((f for f in _foreseen if f.is_whole and f.sources.is_as(sources)), None)
    if ready is None or (_keeps(ob) and (ready.step is None or ready.step != _step(ob))):
        ready = _Foreseen(after, sources, None)
        for _ in ready.find(ob.session_uid):
            pass
    forget()
    sources = ready.sources
    if MASK in given:
        painted[MASK] = given[MASK][sources.vertices]
    if FACE in sources.places:
        faces, surface = sources.places[FACE].index, sources.before
        if FACE_SET in given:
            painted[FACE_SET] = surface.own(given[FACE_SET], FACE)[faces]
        if (hidden := _hidden_faces(mesh, given)).any():
            painted |= _hidden(new, surface.own(hidden, FACE)[faces])
    return painted, ready.result


def _asked(
    ob: Object,
    painted: Painted,
    positions: Callable[[], Vectors],
    vertices: NDArray[np.generic],
    triangles: NDArray[np.generic],
) -> Sources | None:
    """The sources that `carried` has to find; None when it needs none."""
    mesh = mesh_of(ob)
    wanted = attributes.domains(ob, mesh)
    if MASK in painted:
        wanted |= {VERTEX}
    if FACE_SET in painted or _hidden_faces(mesh, painted).any():
        wanted |= {FACE}
    if not wanted or not len(triangles) or not len(mesh.polygons):
        return None
    return Sources(
        MeshSurface.of(mesh, positions()),
        np.ascontiguousarray(vertices, np.float32),
        np.ascontiguousarray(triangles, np.int32),
        frozenset(wanted),
    )


def _step(ob: Object) -> Step | None:
    """The step of Blender's history that is active. While it is the same, so is what hangs on the
    mesh: whatever the artist does to it is a step. None where nothing hangs on the mesh."""
    return sculpt_steps.active() if _keeps(ob) else None


def _keeps(ob: Object) -> bool:
    """Whether more hangs on the mesh than what brushes painted."""
    return bool(attributes.domains(ob, mesh_of(ob)))


def _hidden_faces(mesh: Mesh, painted: Mapping[str, np.ndarray]) -> NDArray[np.bool_]:
    """Which faces (F,) are hidden, or have a hidden vertex."""
    hidden = painted.get(HIDDEN_FACE, np.zeros(len(mesh.polygons), bool))
    if HIDDEN_VERTEX in painted and _is_triangles(mesh):
        hidden = hidden | painted[HIDDEN_VERTEX][corners_of(mesh)].any(axis=1)
    return hidden


def _hidden(new: Geometry, faces: NDArray[np.bool_]) -> dict[str, NDArray[np.bool_]]:
    """The attributes that hide `faces` (F,), and the vertices and edges of no other face."""
    vertices = np.ones(len(new.vertices) // 3, bool)
    edges = np.ones(len(new.edges) // 2, bool)
    vertices[new.corners.reshape(-1, 3)[~faces]] = False
    edges[new.corner_edges.reshape(-1, 3)[~faces]] = False
    return {HIDDEN_VERTEX: vertices, HIDDEN_EDGE: edges, HIDDEN_FACE: faces}


def _painted(mesh: Mesh) -> dict[str, np.ndarray]:
    """The attributes that say something."""
    return {name: values for name, values in brush_attributes.read(mesh).items() if values.any()}


def _is_triangles(mesh: Mesh) -> bool:
    return len(mesh.loops) == 3 * len(mesh.polygons)
