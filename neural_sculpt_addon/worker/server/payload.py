# SPDX-License-Identifier: GPL-3.0-or-later
"""Payload: the fields and arrays that a job is given, and those of its result.

A base travels as the bytes of `field.checkpoint.to_bytes`, a layer as those of `layer_to_bytes`,
both in uint8 arrays; a proxy as `vertices`, `normals` (V, 3) float32, `triangles` (F, 3), `edges`
(E, 2) and, from each corner to the next, `corner_edges` (F, 3) int32, in model space.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ...common.errors import SculptError
from ...common.progress import Progress

if TYPE_CHECKING:
    from ...field.mesh.proxy import Proxy
    from ...field.mesh.refinement.refine import Refined

T = TypeVar("T")


@dataclass(frozen=True)
class Payload:
    """What goes into a job and what comes out of it."""

    fields: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Task(Payload):
    """A job to be done.

    preview: sends what the result looks like so far
    enough:  whether the artist wants what is there now
    """

    preview: Callable[[Payload], None] = field(kw_only=True)
    enough: Callable[[], bool] = field(kw_only=True)


class MissingError(SculptError):
    """The worker lacks bytes that a job names: those with the `ids`."""

    def __init__(self, ids: Sequence[str]) -> None:
        super().__init__("The worker has lost a part of the field; try again.")
        self.ids = list(ids)


Handler = Callable[[Task, Progress], Payload]
"""Raises SculptError for the artist, Cancelled when `progress` did."""


def read(job: Payload, name: str, wanted: type[T]) -> T:
    """A field of the job. SculptError unless it is of the wanted type."""
    value = job.fields.get(name)
    if type(value) is not wanted:
        raise SculptError(
            "The job's {} must be of type {}, not {}.",
            repr(name),
            wanted.__name__,
            f"{value!r:.100}",
        )
    return value


def read_array(job: Payload, name: str) -> np.ndarray:
    """An array of the job. SculptError when there is none."""
    if name not in job.arrays:
        raise SculptError("The job lacks the array {}.", repr(name))
    return job.arrays[name]


def read_numbers(job: Payload, name: str, count: int) -> np.ndarray:
    """A field of the job, `count` numbers (or one alone) as float64. SculptError unless it is."""
    values = job.fields.get(name)
    numbers = values if isinstance(values, list) else [values]
    if len(numbers) != count or any(type(each) not in (int, float) for each in numbers):
        raise SculptError(
            "The job's {} must be {} numbers, not {}.", repr(name), count, f"{values!r:.60}"
        )
    return np.array(numbers, float)


def proxy_arrays(proxy: "Proxy | Refined", in_order: bool = False) -> dict[str, np.ndarray]:
    """A proxy as it travels; `in_order` where it will stay and nobody waits for it: Blender's
    brushes like neighbours to be near (see `morton_order`)."""
    from ...field.mesh.edges import find_edges
    from ...field.mesh.morton_order import morton_order

    vertices, normals, triangles = proxy.vertices, proxy.normals, proxy.triangles
    if in_order:
        order, triangles = morton_order(vertices, triangles)
        vertices, normals = vertices[order], normals[order]
    edges, corner_edges = find_edges(triangles)
    return {
        "vertices": vertices,
        "normals": normals,
        "triangles": triangles,
        "edges": edges,
        "corner_edges": corner_edges,
    }


def as_array(data: bytes) -> np.ndarray:
    """Bytes as they travel."""
    return np.frombuffer(data, np.uint8)
