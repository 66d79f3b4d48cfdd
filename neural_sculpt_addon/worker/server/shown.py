# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy of a state of a field, at the resolution that a job asks for, refined or not.

    resolution: cells per axis;  triangles: refined to so many at most, 0 or none where not refined

The last meshes are kept, and the next one is updated from that of the nearest state: of those of
the same base the one that has the fewest other layers. That is the state on which a stroke was
drawn, after undo, too, and where another object has the same base. So the new mesh has the very
vertices of the one in Blender, but for those that the stroke reaches.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Generic, TypeVar

from ...common.errors import SculptError
from ...common.progress import Progress, sub_progress
from .cache import Cache
from .payload import Payload, read
from .store import proxy_bytes

if TYPE_CHECKING:
    from ...field.edit.layers import State, Term
    from ...field.field import Field
    from ...field.mesh.proxy import Proxy
    from ...field.mesh.refinement.refine import Refined

MOST_TRIANGLES = 10_000_000
"""Triangles that a job can ask for."""

MESH_BYTES = 64 << 20
"""Bytes of the coarse meshes that are kept, and of the refined ones, which take some 7 MB for
100,000 triangles."""

M = TypeVar("M")


class _Meshes(Generic[M]):
    """The last meshes of states, each with its layers."""

    def __init__(self, size: Callable[[M], int]) -> None:
        """There is none yet; one takes `size`(mesh) bytes."""
        self._kept: Cache[tuple[object, ...], tuple[Sequence[Term], M]]
        self._kept = Cache(MESH_BYTES, lambda kept: size(kept[1]))

    def nearest(self, state: "State", *how: int) -> "tuple[Sequence[Term], M] | None":
        """Layers and mesh of the nearest state of the same base, of meshes that were made in this
        way; of several the newest."""
        from ...field.edit.layers import distance

        made = [kept for (*known, _), kept in self._kept.items() if known == [state.base, *how]]
        return min(reversed(made), key=lambda kept: distance(kept[0], state.terms), default=None)

    def keep(self, mesh: M, state: "State", *how: int) -> None:
        """Remember a mesh."""
        layers = tuple((term.layer.id, term.strength) for term in state.terms)
        self._kept[state.base, *how, layers] = state.terms, mesh


class ProxyMaker:
    """Makes the meshes of states, and keeps the last ones."""

    def __init__(self) -> None:
        """There is no mesh yet."""
        self._coarse: _Meshes[Proxy] = _Meshes(proxy_bytes)
        self._refined: _Meshes[Refined] = _Meshes(_refined_bytes)

    def state(self, state: "State", job: Payload, progress: Progress) -> "Proxy | Refined":
        """The mesh of a state."""
        from ...field.edit.layers import reached
        from ...field.mesh.refinement.refine import again, refine

        most = _most(job)
        proxy = self._proxy(state, job, sub_progress(progress, 0.0, 0.5 if most else 1.0))
        if not most:
            return proxy
        progress = sub_progress(progress, 0.5, 1.0)
        field, how = state.preparation.field, (proxy.active.cells, most)
        last = self._refined.nearest(state, *how)
        if last is None:
            refined = refine(field, proxy, most, progress=progress)
        elif last[1].coarse is proxy:
            refined = last[1]
        else:
            terms, mesh = last
            refined = again(field, proxy, mesh, reached(terms, state.terms), most, progress)
        self._refined.keep(refined, state, *how)
        return refined

    def _proxy(self, state: "State", job: Payload, progress: Progress) -> "Proxy":
        """The proxy of a state, which the state itself has at the usual resolution."""
        from ...field.edit.layers import distance, reached
        from ...field.mesh.proxy import extract, update
        from ...field.problem.prepare import CELLS

        cells, field = read(job, "resolution", int), state.preparation.field
        if cells == CELLS:
            return state.preparation.proxy
        terms, proxy = self._coarse.nearest(state, cells) or ((), None)
        if proxy is None:
            proxy = extract(field, cells, progress)
        elif distance(terms, state.terms):
            proxy = update(proxy, field, reached(terms, state.terms), progress)
        self._coarse.keep(proxy, state, cells)
        return proxy


def _refined_bytes(refined: "Refined") -> int:
    """Memory that a refined mesh takes with the proxy that it refines."""
    mesh = [refined.vertices, refined.normals, refined.triangles, refined.parents, *refined.splits]
    return proxy_bytes(refined.coarse) + sum(array.nbytes for array in mesh)


def refined(field: "Field", proxy: "Proxy", job: Payload, progress: Progress) -> "Proxy | Refined":
    """The mesh of a field without a state: its proxy, refined where the job asks for it."""
    from ...field.mesh.refinement.refine import refine

    most = _most(job)
    return refine(field, proxy, most, progress=progress) if most else proxy


def _most(job: Payload) -> int:
    """The triangles that a job allows, 0 where nothing is to be refined. SculptError."""
    most = job.fields.get("triangles", 0)
    if type(most) is not int or not 0 <= most <= MOST_TRIANGLES:
        raise SculptError(
            "A proxy is refined to at most {} triangles, not to {}. Choose fewer.",
            f"{MOST_TRIANGLES:,}",
            f"{most!r:.60}",
        )
    return most
