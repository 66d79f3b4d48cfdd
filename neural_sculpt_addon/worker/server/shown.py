# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy of a state of a field, at the resolution that a job asks for, refined or not.

    resolution: cells per axis;  triangles: refined to so many at most, 0 or none where not refined

The last mesh is kept: the next one is updated from it where both states have the same base.
"""

from typing import TYPE_CHECKING, NamedTuple

from ...common.errors import SculptError
from ...common.progress import Progress, sub_progress
from .payload import Payload, read

if TYPE_CHECKING:
    from ...field.edit.layers import State
    from ...field.field import Field
    from ...field.mesh.proxy import Proxy
    from ...field.mesh.refinement.refine import Refined

MOST_TRIANGLES = 10_000_000
"""Triangles that a job can ask for."""


class _Last(NamedTuple):
    """The last refined mesh, of `most` triangles or fewer."""

    state: "State"
    refined: "Refined"
    most: int


class ProxyMaker:
    """Makes the meshes of states, and keeps the last one."""

    def __init__(self) -> None:
        """There is no mesh yet."""
        self._coarse: tuple[State, Proxy] | None = None
        self._refined: _Last | None = None

    def state(self, state: "State", job: Payload, progress: Progress) -> "Proxy | Refined":
        """The mesh of a state."""
        from ...field.edit.layers import reached
        from ...field.mesh.refinement.refine import again, refine

        most = _most(job)
        proxy = self._proxy(state, job, sub_progress(progress, 0.0, 0.5 if most else 1.0))
        if not most:
            return proxy
        progress = sub_progress(progress, 0.5, 1.0)
        field, last = state.preparation.field, self._refined
        if last is not None and (last.state.base, last.most) == (state.base, most):
            if last.state is state and last.refined.coarse is proxy:
                return last.refined
            changed = reached(last.state.terms, state.terms)
            refined = again(field, proxy, last.refined, changed, most, progress)
        else:
            refined = refine(field, proxy, most, progress=progress)
        self._refined = _Last(state, refined, most)
        return refined

    def _proxy(self, state: "State", job: Payload, progress: Progress) -> "Proxy":
        """The proxy of a state, which the state itself has at the usual resolution.

        At another one the last proxy is updated, if both states have the same base.
        """
        from ...field.edit.layers import reached
        from ...field.mesh.proxy import extract, update
        from ...field.problem.prepare import CELLS

        cells = read(job, "resolution", int)
        if cells == CELLS:
            return state.preparation.proxy
        shown, last = self._coarse or (state, state.preparation.proxy)
        if shown.base == state.base and last.active.cells == cells:
            changed = reached(shown.terms, state.terms)
            proxy = update(last, state.preparation.field, changed, progress)
        else:
            proxy = extract(state.preparation.field, cells, progress)
        self._coarse = state, proxy
        return proxy


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
