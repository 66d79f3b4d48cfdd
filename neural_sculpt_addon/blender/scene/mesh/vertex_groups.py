# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex groups as arrays (V, G), and the conversion of attributes by which Blender makes such
groups.

Blender keeps their weights vertex by vertex, without attributes.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.types import Mesh, Object
from numpy.typing import NDArray

Weights = NDArray[np.float32]

PIECE = 2048  # vertices that are read in a step, some 3 ms
ATTRIBUTE = ".neural_sculpt_weight"
"""Name of the attribute that Blender converts to a vertex group, 25 times as fast as weights set
vertex by vertex."""


@dataclass(frozen=True)
class Group:
    """A vertex group without its weights."""

    name: str
    locked: bool


def listed(ob: Object) -> list[Group]:
    """The groups in order."""
    return [Group(group.name, group.lock_weight) for group in ob.vertex_groups]


def weights(mesh: Callable[[], Mesh], count: int) -> Generator[None, None, Weights]:
    """The weights (V, G) of the first `count` groups, -1 where a vertex is in none.

    mesh: tells the mesh anew in each step
    """
    found = np.full((len(mesh().vertices), count), -1, np.float32)
    for start in range(0, len(found), PIECE):
        for i, vertex in enumerate(mesh().vertices[start : start + PIECE], start):
            for element in vertex.groups:
                if element.group < count:
                    found[i, element.group] = element.weight
        yield
    return found


def write(ob: Object, groups: Sequence[Group], weights: Weights) -> None:
    """Give an object, which has none, these groups."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    for group, column in zip(groups, weights.T, strict=True):
        if (column > 0).any():
            mesh.attributes.new(ATTRIBUTE, "FLOAT", "POINT")
            data = mesh.attributes[ATTRIBUTE].data  # pyright: ignore[reportAttributeAccessIssue]
            data.foreach_set("value", np.maximum(column, 0))
            convert(ob, ATTRIBUTE, mode="VERTEX_GROUP")
            made = ob.vertex_groups[-1]
            made.name = group.name
        else:
            made = ob.vertex_groups.new(name=group.name)
        if nothing := np.flatnonzero(column == 0).tolist():
            made.add(nothing, 0.0, "REPLACE")
        made.lock_weight = group.locked


def convert(ob: Object, name: str, **into: str) -> None:
    """Make something else of an attribute of an object's mesh, as Convert Attribute does."""
    assert isinstance(ob.data, Mesh)
    ob.data.attributes.active = ob.data.attributes[name]
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, object=ob, active_object=ob):
        bpy.ops.geometry.attribute_convert(**into)  # pyright: ignore[reportArgumentType]
