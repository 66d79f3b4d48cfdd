# SPDX-License-Identifier: GPL-3.0-or-later
"""History by layers: field = base + sum of strength x layer over the visible layers.

Each stroke, and each absorbed sculpt, keeps the coefficients that it added. They are multiples of a
fixed unit, so the sum is exact in any order: muting, fading, moving or deleting a layer adds and
subtracts, and leaves no trace.

The *support* of a layer are the cells that its coefficients reach. Two layers touch when their
supports have a cell in common. The *context* of a layer is what it was solved on: the base, and the
visible layers beneath it that touch it, with their strengths. A layer is valid while its context is
the same. Otherwise its stroke is solved again, which may change the context of layers above.
Absorbed sculpting has no stroke that could be solved again: it keeps its coefficients. Model space.
See docs/method.md, section 7.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, MutableMapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.errors import SculptError
from ...common.progress import Progress, silent, sub_progress
from ...common.text import Text
from ...stroke.stroke import Stroke
from ..field import Field
from ..layer_bytes import layer_from_bytes, layer_to_bytes
from ..levels import SUPPORT, Coefficients, Level, cells_per_axis, merged, scaled, support
from ..mesh.proxy import update
from ..problem.prepare import Preparation, prepare
from .brushed import AbsorbedStroke
from .edit import Edit, Solver, sculpt

REMEMBERED = 8
"""Solutions of one stroke in a `Memo`, each in another context."""


@dataclass(frozen=True, eq=False)
class Layer:
    """The coefficients that one stroke added."""

    id: str  # `digest` of the data
    data: bytes  # as of `layer_to_bytes`
    coefficients: Coefficients

    @staticmethod
    def of(coefficients: Coefficients) -> "Layer":
        """The layer of these coefficients."""
        data = layer_to_bytes(coefficients)
        return Layer(digest(data), data, coefficients)

    @staticmethod
    def read(data: bytes) -> "Layer":
        """The layer whose bytes these are. SculptError when they are none."""
        return Layer(digest(data), data, layer_from_bytes(data))

    @cached_property
    def support(self) -> NDArray[np.int32]:
        """The cells (S,) that the layer changes, as of `levels.support`."""
        return support(self.coefficients)


class Term(NamedTuple):
    """A visible layer in the sum."""

    layer: Layer
    strength: float  # in [0, 1]


class Solved(NamedTuple):
    """A layer and the context that it was solved in."""

    layer: Layer
    context: str


@dataclass(frozen=True)
class Entry:
    """A visible line of the history.

    stroke: None of absorbed sculpting
    solved: as far as it is known; None to solve the stroke
    """

    stroke: Stroke | None
    solved: Solved | None
    strength: float = 1.0


Memo = MutableMapping[str, tuple[Solved, ...]]
"""What strokes were solved to, by `stroke_key`, newest last."""


@dataclass(frozen=True)
class State:
    """A field as the sum of a base and layers."""

    base: str  # id of the base
    terms: tuple[Term, ...]  # in the order of the history
    preparation: Preparation

    @staticmethod
    def made(
        base: str, field: Field, terms: Sequence[Term], progress: Progress = silent
    ) -> "State":
        """The state of the base `field` and `terms`, from nothing."""
        return State(base, tuple(terms), prepare(summed(field, terms), progress))

    def moved(self, terms: Sequence[Term], progress: Progress = silent) -> "State":
        """The state of the same base and other `terms`."""
        change = difference(self.terms, terms)
        if not change:
            return replace(self, terms=tuple(terms))
        field = self.preparation.field.plus(change)
        proxy = update(self.preparation.proxy, field, support(change), progress)
        return State(self.base, tuple(terms), Preparation(field, proxy))

    def solved(self, coefficients: Coefficients) -> Solved:
        """What was solved, or absorbed, on top of this state."""
        layer = Layer.of(coefficients)
        return Solved(layer, context(self.base, self.terms, layer))

    def absorbed(self, stroke: AbsorbedStroke) -> tuple["State", Solved]:
        """The state after a brush stroke on the proxy, and its layer."""
        solved = self.solved(stroke.layer)
        terms = (*self.terms, Term(solved.layer, 1.0))
        return State(self.base, terms, stroke.preparation), solved

    def sculpted(
        self, stroke: Stroke, memo: Memo, progress: Progress = silent
    ) -> tuple["State", Solved, Edit]:
        """The state after one more stroke, its layer, which `memo` is given, and its edit.

        SculptError as of `edit.sculpt`.
        """
        edit = sculpt(self.preparation, stroke, solver=Solver.LOCAL, progress=progress)
        assert edit.layer is not None
        solved = self.solved(edit.layer)
        key = stroke_key(stroke)
        memo[key] = (*memo.get(key, ()), solved)[-REMEMBERED:]
        terms = (*self.terms, Term(solved.layer, 1.0))
        return State(self.base, terms, edit.preparation), solved, edit


def replay(
    known: State, entries: Sequence[Entry], memo: Memo, progress: Progress = silent
) -> tuple[State, tuple[Solved, ...]]:
    """The state of all `entries`, and the layer of each.

    known: any state of the same base; the fewer layers differ, the faster
    memo:  is looked up before a stroke is solved, and given what was solved

    Strokes are solved again only where their context has changed. SculptError, which names the
    stroke, when one cannot be applied where it stands now.
    """
    state, terms, found = known, list[Term](), list[Solved]()
    for number, entry in enumerate(entries):
        solved = _valid(entry, known.base, terms, memo)
        if solved is None:
            if entry.stroke is None:
                raise SculptError("What was sculpted by other brushes is missing in the history.")
            share = numbered(sub_progress(progress, 0.0, 0.9), number, len(entries))
            with naming(entry.stroke, number):
                state = state.moved(terms, sub_progress(share, 0.0, 0.3))
                share = sub_progress(share, 0.3, 1.0)
                state, solved, _ = state.sculpted(entry.stroke, memo, share)
        found.append(solved)
        terms.append(Term(solved.layer, entry.strength))
    return state.moved(terms, sub_progress(progress, 0.9, 1.0)), tuple(found)


@contextmanager
def naming(stroke: Stroke, number: int) -> Iterator[None]:
    """Let a SculptError say which stroke of a replay it is about."""
    try:
        yield
    except SculptError as error:
        name = stroke.name[:100] or Text("Stroke {}", number + 1)
        raise SculptError("{}: {} Nothing was changed.", name, error) from error


def numbered(progress: Progress, number: int, count: int) -> Progress:
    """Progress of one of the strokes of a replay."""
    share = sub_progress(progress, number / count, (number + 1) / count)

    def report(fraction: float, message: str) -> None:
        share(fraction, Text("Stroke {} of {}: {}", number + 1, count, Text(message)))

    return report


def context(base: str, beneath: Iterable[Term], layer: Layer) -> str:
    """The context of `layer` on the layers `beneath` it."""
    reached = np.zeros(cells_per_axis(SUPPORT) ** 3, bool)
    reached[layer.support] = True
    touching = [
        (term.layer.id, float(term.strength))
        for term in beneath
        if term.strength and reached.take(term.layer.support).any()
    ]
    return digest(json.dumps([base, touching]).encode())


def digest(data: bytes) -> str:
    """The id of bytes: their SHA-256 in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


def stroke_key(stroke: Stroke) -> str:
    """All that a solver sees of a stroke: its name is not part of it."""
    return json.dumps({**stroke.to_json(), "name": ""}, sort_keys=True)


def summed(base: Field, terms: Sequence[Term]) -> Field:
    """The field of a base and layers."""
    return base.plus(difference((), terms))


def distance(before: Sequence[Term], after: Sequence[Term]) -> int:
    """How many layers must be added or taken away to come from one sum to another."""
    return sum(map(abs, _counts(before, after).values()))


def difference(before: Sequence[Term], after: Sequence[Term]) -> Coefficients:
    """What must be added to the sum of `before` to make it that of `after`, without zeros."""
    layers = {term.layer.id: term.layer for term in (*before, *after)}
    parts: dict[int, list[Level]] = {}
    for (name, strength), sign in _counts(before, after).items():
        if sign and strength:
            for level, part in scaled(layers[name].coefficients, strength).items():
                parts.setdefault(level, []).append(Level(part.index, sign * part.values))
    sums = {level: Level.sum(some) for level, some in sorted(parts.items())}
    return {level: part for level, part in sums.items() if len(part.index)}


def reached(before: Sequence[Term], after: Sequence[Term]) -> NDArray[np.int32]:
    """The cells (S,), as of `levels.support`, outside of which the sums of both are the same."""
    layers = {term.layer.id: term.layer for term in (*before, *after)}
    counts = _counts(before, after).items()
    supports = [layers[name].support for (name, strength), sign in counts if sign and strength]
    return merged(np.concatenate([np.empty(0, np.int32), *supports]))


def _counts(before: Sequence[Term], after: Sequence[Term]) -> Counter[tuple[str, float]]:
    """How often each layer at each strength must be added, or with a minus taken away."""
    counts = Counter((term.layer.id, term.strength) for term in after)
    counts.subtract((term.layer.id, term.strength) for term in before)
    return counts


def _valid(entry: Entry, base: str, beneath: Sequence[Term], memo: Memo) -> Solved | None:
    """What is known of the entry and still true; of absorbed sculpting that is made so."""
    if entry.stroke is None:
        if entry.solved is None:
            return None
        layer = entry.solved.layer
        return Solved(layer, context(base, beneath, layer))
    if entry.solved and entry.solved.context == context(base, beneath, entry.solved.layer):
        return entry.solved
    known = reversed(memo.get(stroke_key(entry.stroke), ()))
    return next((s for s in known if s.context == context(base, beneath, s.layer)), None)
