# SPDX-License-Identifier: GPL-3.0-or-later
"""What shows a state of a field: its proxy at the resolution that a job asks for, refined or not.

    resolution: cells per axis;  triangles: refined to so many at most, 0 or none where not refined

What was shown last is kept: the next is updated from it where both have the same base.
"""

from typing import TYPE_CHECKING, NamedTuple

from ...common.errors import SculptError
from ...common.progress import Progress, sub_progress
from .payload import Payload, read

if TYPE_CHECKING:
    from ...field.edit.layers import State
    from ...field.field import Field
    from ...field.mesh.proxy import Proxy
    from ...field.mesh.refine import Refined

MOST = 10_000_000
"""Triangles that a job can ask for."""


class _Last(NamedTuple):
    """A refinement that was shown, of at most so many triangles."""

    state: "State"
    refined: "Refined"
    most: int


class Shown:
    """What shows states."""

    def __init__(self) -> None:
        """Nothing was shown yet."""
        self._coarse: tuple[State, Proxy] | None = None
        self._refined: _Last | None = None

    def state(self, state: "State", job: Payload, progress: Progress) -> "Proxy | Refined":
        """What shows a state."""
        from ...field.detail import support
        from ...field.edit.layers import difference
        from ...field.mesh.refine import again, refine

        most = _most(job)
        proxy = self._proxy(state, job, sub_progress(progress, 0.0, 0.5 if most else 1.0))
        if not most:
            return proxy
        progress = sub_progress(progress, 0.5, 1.0)
        field, last = state.preparation.field, self._refined
        if last is not None and (last.state.base, last.most) == (state.base, most):
            reached = support(difference(last.state.terms, state.terms))
            refined = again(field, proxy, last.refined, reached, most, progress)
        else:
            refined = refine(field, proxy, most, progress=progress)
        self._refined = _Last(state, refined, most)
        return refined

    def _proxy(self, state: "State", job: Payload, progress: Progress) -> "Proxy":
        """The proxy of a state, which is known already at the usual resolution.

        At another one it is that of the state that was shown last, updated, when both have the same
        base.
        """
        from ...field.detail import support
        from ...field.edit.layers import difference
        from ...field.mesh.proxy import extract, update
        from ...field.problem.prepare import CELLS

        cells = read(job, "resolution", int)
        if cells == CELLS:
            return state.preparation.proxy
        shown, last = self._coarse or (state, state.preparation.proxy)
        if shown.base == state.base and last.active.cells == cells:
            reached = support(difference(shown.terms, state.terms))
            proxy = update(last, state.preparation.field, reached, progress)
        else:
            proxy = extract(state.preparation.field, cells, progress)
        self._coarse = state, proxy
        return proxy


def refined(field: "Field", proxy: "Proxy", job: Payload, progress: Progress) -> "Proxy | Refined":
    """What shows a field whose proxy was made, and of which no state is known."""
    from ...field.mesh.refine import refine

    most = _most(job)
    return refine(field, proxy, most, progress=progress) if most else proxy


def _most(job: Payload) -> int:
    """The triangles that a job allows, 0 where nothing is to be refined. SculptError."""
    most = job.fields.get("triangles", 0)
    if type(most) is not int or not 0 <= most <= MOST:
        raise SculptError(
            f"A proxy is refined to at most {MOST:,} triangles, not to {most!r:.60}. Choose fewer."
        )
    return most
