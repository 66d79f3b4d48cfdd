# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of a mesh that an artist has put there: UV maps, colors, the material of each face,
vertex groups and any others. A stroke brings another proxy, whose mesh has none of them; here they
are read and written.

Left out are attributes of the shape and of its shading; those of edges, for the new proxy has
others; and Blender's own, whose names begin with a dot. `brush_attributes` has some of the latter.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from bpy.types import Mesh, Object
from numpy.typing import NDArray

from . import vertex_groups
from .vertex_groups import Group, convert

Values = NDArray[np.generic]

POINT, FACE, CORNER = "POINT", "FACE", "CORNER"


class AttributeType(NamedTuple):
    """A type of attribute: the member that holds a value, how many numbers that has, their type,
    and whether values can be interpolated."""

    member: str
    width: int
    dtype: type[np.generic]
    blends: bool = False


TYPES = {
    "FLOAT": AttributeType("value", 1, np.float32, True),
    "FLOAT2": AttributeType("vector", 2, np.float32, True),
    "FLOAT_VECTOR": AttributeType("vector", 3, np.float32, True),
    "FLOAT_COLOR": AttributeType("color", 4, np.float32, True),
    "BYTE_COLOR": AttributeType("color", 4, np.float32, True),  # linear, as those of floats
    "QUATERNION": AttributeType("value", 4, np.float32),
    "FLOAT4X4": AttributeType("value", 16, np.float32),
    "INT": AttributeType("value", 1, np.int32),
    "INT8": AttributeType("value", 1, np.int32),
    "INT32_2D": AttributeType("value", 2, np.int32),
    "BOOLEAN": AttributeType("value", 1, np.bool_),
}
MATERIAL = "material_index"
OF_SHAPE = {"position", "custom_normal", "sharp_face", "crease_vert", "bevel_weight_vert"}


@dataclass(eq=False)
class AttributeLayer:
    """An attribute with its values (N, W), one row for each element of its domain.

    kind:   one of TYPES, Blender's `data_type`
    domain: POINT, FACE or CORNER
    """

    kind: str
    domain: str
    values: Values

    @property
    def blends(self) -> bool:
        """Whether values can be interpolated."""
        return TYPES[self.kind].blends


@dataclass(frozen=True)
class Roles:
    """The names of the layers that are active, and of those that are rendered."""

    color: str = ""
    rendered_color: str = ""
    uv: str = ""
    rendered_uv: str = ""


@dataclass(eq=False)
class Attributes:
    """What was read of a mesh.

    groups:  vertex groups, whose weights (V, G) are -1 where a vertex is in none
    """

    layers: dict[str, AttributeLayer] = field(default_factory=dict)
    groups: list[Group] = field(default_factory=list)
    weights: NDArray[np.float32] | None = None
    active_group: int = 0
    roles: Roles = Roles()


def domains(ob: Object, mesh: Mesh) -> set[str]:
    """The domains that have something to read; vertex groups count as POINT."""
    found = {domain for _, _, domain in _listed(mesh)}
    return found | {POINT} if ob.vertex_groups else found


def read(ob: Callable[[], Object], mesh: Callable[[], Mesh]) -> Generator[None, None, Attributes]:
    """All attributes of a mesh, read in steps of some milliseconds: byte colors at 600,000 corners
    take 16.

    ob, mesh: tell the object and its mesh anew in each step
    """
    groups = ob().vertex_groups
    found = Attributes(
        groups=vertex_groups.listed(ob()),
        active_group=groups.active_index or 0,
        roles=_roles(mesh()),
    )
    for name, kind, domain in _listed(mesh()):
        member, width, dtype, _ = TYPES[kind]
        attribute = mesh().attributes.get(name)
        if attribute is not None and (attribute.data_type, attribute.domain) == (kind, domain):
            flat = np.empty(len(attribute.data) * width, dtype)
            attribute.data.foreach_get(member, flat)
            found.layers[name] = AttributeLayer(kind, domain, flat.reshape(-1, width))
        yield
    if found.groups:
        found.weights = yield from vertex_groups.weights(mesh, len(found.groups))
    return found


def write(ob: Object, new: Attributes) -> None:
    """Give an object's mesh, which has none of them, these attributes.

    With 100,000 vertices a vertex group takes 4 ms, colors of bytes 4 ms and at the corners 20, of
    all cores together, and all else below 1 ms each.
    """
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    for name, layer in new.layers.items():
        kind = "FLOAT_COLOR" if layer.kind == "BYTE_COLOR" else layer.kind  # set as one block
        mesh.attributes.new(name, kind, layer.domain)  # pyright: ignore[reportArgumentType]
        data = mesh.attributes[name].data  # pyright: ignore[reportAttributeAccessIssue]
        data.foreach_set(TYPES[kind].member, np.ascontiguousarray(layer.values).ravel())
        if kind != layer.kind:
            convert(ob, name, domain=layer.domain, data_type=layer.kind)
    _give_roles(mesh, new.roles)
    if new.weights is not None:
        vertex_groups.write(ob, new.groups, new.weights)
        ob.vertex_groups.active_index = new.active_group


def _listed(mesh: Mesh) -> list[tuple[str, str, str]]:
    """Names, types and domains. The material of the faces is left out where all have the first one:
    a mesh without that attribute says the same."""
    found = [
        (each.name, each.data_type, each.domain)
        for each in mesh.attributes
        if each.data_type in TYPES
        and each.domain in (POINT, FACE, CORNER)
        and not each.name.startswith(".")
        and each.name not in OF_SHAPE
    ]
    if (material := (MATERIAL, "INT", FACE)) in found:
        index = np.empty(len(mesh.polygons), np.int32)
        mesh.attributes[MATERIAL].data.foreach_get("value", index)  # pyright: ignore[reportAttributeAccessIssue]
        if not index.any():
            found.remove(material)
    return found


def _roles(mesh: Mesh) -> Roles:
    maps = mesh.uv_layers
    rendered = next((each.name for each in maps if each.active_render), "")
    attributes = mesh.attributes
    return Roles(
        attributes.active_color_name or "",
        attributes.default_color_name or "",
        maps.active.name if maps.active else "",
        rendered,
    )


def _give_roles(mesh: Mesh, roles: Roles) -> None:
    if roles.color in mesh.attributes:
        mesh.attributes.active_color_name = roles.color
    if roles.rendered_color in mesh.attributes:
        mesh.attributes.default_color_name = roles.rendered_color
    if (place := mesh.uv_layers.find(roles.uv)) >= 0:
        mesh.uv_layers.active_index = place
    if roles.rendered_uv in mesh.uv_layers:
        mesh.uv_layers[roles.rendered_uv].active_render = True
