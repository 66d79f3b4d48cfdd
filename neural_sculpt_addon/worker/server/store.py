# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker remembers: bases and layers by id, states by revision.

A job's field `state` names a field: {"base": ID, "layers": [[ID, strength], ...]}, the visible
layers in order. An id is the SHA-256 of bytes; those that the worker lacks come as uint8 arrays
named by it. All of it is a cache: Blender can send everything again.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from ...common.errors import SculptError
from ...common.progress import Progress
from .cache import Cache
from .payload import MissingError, Payload, read

if TYPE_CHECKING:
    import torch

    from ...field.edit.layers import Layer, Memo, Solved, State, Term
    from ...field.field import Field
    from ...field.mesh.proxy import Proxy
    from ...field.problem.prepare import Preparation

    Base = tuple[str, Field]

V = TypeVar("V")

BASE_BYTES, LAYER_BYTES, STATE_BYTES = 64 << 20, 128 << 20, 512 << 20
SOLUTION_BYTES, RESULT_BYTES = 128 << 20, 128 << 20
"""Bytes of each kind; a state with 100 strokes takes some 50 MB, one without detail 10."""

SAMPLE_BYTES = 4 << 20
"""Bytes of the samples of a state, which are drawn when they are first needed."""


class Store:
    """The caches of one worker.

    memo:    what strokes were solved to
    results: what strokes made of networks, see `replay.result_key`
    """

    def __init__(self, device: "torch.device") -> None:
        """Nothing is known yet; fields are kept on `device`."""
        self._device = device
        self.memo: Memo = Cache(SOLUTION_BYTES, _solved_bytes)
        self.results: Cache[str, State] = Cache(RESULT_BYTES, _state_bytes)
        self._bases: Cache[str, Field] = Cache(BASE_BYTES, _field_bytes)
        self._layers: Cache[str, Layer] = Cache(LAYER_BYTES, _layer_bytes)
        self._states: Cache[str, State] = Cache(STATE_BYTES, _state_bytes)

    def on_device(self, field: "Field") -> "Field":
        """A field where fields are kept."""
        return field.to(self._device)

    def keep_base(self, field: "Field") -> tuple[str, bytes]:
        """Remember a field that a job made as a base; its id and bytes."""
        from ...field.checkpoint import to_bytes
        from ...field.edit.layers import digest

        data = to_bytes(field)
        self._bases[name := digest(data)] = field
        return name, data

    def new_base(self, preparation: "Preparation") -> "tuple[State, bytes]":
        """Keep a base as `keep_base` does; its state without layers, and its bytes."""
        from ...field.edit.layers import State

        name, data = self.keep_base(preparation.field)
        self._states[name] = state = State(name, (), preparation)
        return state, data

    def keep(self, revision: str, state: "State") -> None:
        """Remember a state and its layers."""
        self._states[revision] = state
        for term in state.terms:
            if term.layer.id not in self._layers:
                self._layers[term.layer.id] = term.layer

    def state(self, job: Payload, progress: Progress) -> "State":
        """The state that a job names, made unless it is remembered."""
        revision = read(job, "revision", str)
        if revision not in self._states:
            self._states[revision] = self.made(*self._parts(job), progress)
        return self._states[revision]

    def field(self, job: Payload) -> "Field":
        """The field of the state that a job names."""
        from ...field.edit.layers import summed

        revision = read(job, "revision", str)
        if revision in self._states:
            return self._states[revision].preparation.field
        (_, field), terms = self._parts(job)
        return summed(field, terms)

    def made(self, base: "Base", terms: "Sequence[Term]", progress: Progress) -> "State":
        """The state of a base and layers, from the nearest one that is remembered."""
        from ...field.edit.layers import State

        known = self.nearest(base[0], terms)
        return known.moved(terms, progress) if known else State.made(*base, terms, progress)

    def nearest(self, base: str, terms: "Sequence[Term]") -> "State | None":
        """The remembered state of the same base that has the fewest other layers."""
        from ...field.edit.layers import distance

        states = [state for state in self._states.values() if state.base == base]
        return min(states, key=lambda state: distance(state.terms, terms), default=None)

    def load(
        self, job: Payload, base: object, layers: Sequence[object]
    ) -> "tuple[Base, list[Layer]]":
        """A base and layers by their ids. MissingError when the worker lacks some."""
        from ...field.checkpoint import from_bytes
        from ...field.edit.layers import Layer

        def read_base(data: bytes) -> "Field":
            return from_bytes(data).to(self._device)

        field = _find(job, base, self._bases, read_base)
        found = [_find(job, name, self._layers, Layer.read) for name in layers]
        there = [layer for layer in found if layer is not None]
        if field is None or len(there) < len(found):
            pairs = zip((base, *layers), (field, *found), strict=True)
            raise MissingError(
                list(dict.fromkeys(str(name) for name, value in pairs if value is None))
            )
        return (str(base), field), there

    def _parts(self, job: Payload) -> "tuple[Base, list[Term]]":
        """The base and the terms of the state that a job names."""
        from ...field.edit.layers import Term

        state = read(job, "state", dict)
        layers = state.get("layers")
        if not isinstance(layers, list) or not all(map(_is_pair, layers)):
            raise SculptError("The job's state must have a list of layers and their strengths.")
        base, found = self.load(job, state.get("base"), [name for name, _ in layers])
        strengths = [read_strength(strength) for _, strength in layers]
        return base, list(map(Term, found, strengths))


def read_strength(value: object) -> float:
    """The strength of a layer. SculptError unless it is a number from 0 to 1."""
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= 1:
        return float(value)
    raise SculptError("A layer's strength is a number from 0 to 1, not {}.", f"{value!r:.60}")


def preparation_bytes(preparation: "Preparation") -> int:
    """Memory that a field, its proxy and its samples take."""
    return _field_bytes(preparation.field) + proxy_bytes(preparation.proxy) + SAMPLE_BYTES


def proxy_bytes(proxy: "Proxy") -> int:
    """Memory that a proxy takes, but for what an update starts from, which is much of the same."""
    mesh = [proxy.vertices, proxy.normals, proxy.triangles, proxy.edges]
    return sum(array.nbytes for array in (proxy.active.index, proxy.active.values, *mesh))


def _field_bytes(field: "Field") -> int:
    grids = [array for grid in field.detail.grids for array in (grid.table, grid.bricks)]
    return sum(array.nbytes for array in (*field.network.parameters, *grids))


def _state_bytes(state: "State") -> int:
    return preparation_bytes(state.preparation)


def _layer_bytes(layer: "Layer") -> int:
    parts = layer.coefficients.values()
    return len(layer.data) + sum(part.index.nbytes + part.values.nbytes for part in parts)


def _solved_bytes(known: "tuple[Solved, ...]") -> int:
    return sum(_layer_bytes(solved.layer) for solved in known)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2


def _find(job: Payload, name: object, known: Cache[str, V], make: Callable[[bytes], V]) -> V | None:
    """The value with this id, remembered or made of bytes that the job has brought; None without
    either."""
    from ...field.edit.layers import digest

    if not isinstance(name, str):
        raise SculptError("An id must be a str, not {}.", f"{name!r:.60}")
    if name in known:
        return known[name]
    if name not in job.arrays:
        return None
    data = job.arrays[name].tobytes()
    if digest(data) != name:
        raise SculptError("The bytes of a field or a layer are not those that its id names.")
    made = known[name] = make(data)
    return made
