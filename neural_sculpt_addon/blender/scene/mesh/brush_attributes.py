# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's brushes paint on a mesh beside its shape: masks, face sets, what is hidden.

The field does not know of it. A vertex is protected from strokes as far as it is masked, and in
full where it is hidden or a corner of a hidden face.
"""

from collections.abc import Callable, Mapping

import numpy as np
from bpy.types import Mesh
from numpy.typing import NDArray

MASK, FACE_SET = ".sculpt_mask", ".sculpt_face_set"
HIDDEN_VERTEX, HIDDEN_EDGE, HIDDEN_FACE = ".hide_vert", ".hide_edge", ".hide_poly"

PAINTED = {
    MASK: ("FLOAT", "POINT", np.float32),
    FACE_SET: ("INT", "FACE", np.int32),
    HIDDEN_VERTEX: ("BOOLEAN", "POINT", np.bool_),
    HIDDEN_EDGE: ("BOOLEAN", "EDGE", np.bool_),
    HIDDEN_FACE: ("BOOLEAN", "FACE", np.bool_),
}
"""Attributes: type, domain, type of an array."""


def read(mesh: Mesh) -> dict[str, np.ndarray]:
    """The attributes that are there, as arrays of one value for each vertex, edge or face."""
    found = {}
    for name, (kind, domain, dtype) in PAINTED.items():
        attribute = mesh.attributes.get(name)
        if attribute is not None and (attribute.data_type, attribute.domain) == (kind, domain):
            found[name] = np.empty(len(attribute.data), dtype)
            attribute.data.foreach_get("value", found[name])
    return found


def write(mesh: Mesh, painted: Mapping[str, NDArray[np.generic]]) -> None:
    """Give the attributes these values, and remove those that are not named."""
    now = read(mesh)
    for name in now.keys() - painted.keys():
        mesh.attributes.remove(mesh.attributes[name])
    for name, values in painted.items():
        if name not in now:
            kind, domain, _ = PAINTED[name]
            mesh.attributes.new(name, kind, domain)
        elif np.array_equal(now[name], values):
            continue
        mesh.attributes[name].data.foreach_set("value", values)  # pyright: ignore[reportAttributeAccessIssue]


def protection(
    mesh: Mesh, triangles: Callable[[Mesh], NDArray[np.int32]]
) -> NDArray[np.float32] | None:
    """How far each vertex is protected (V,), from 0 to 1; None when none is.

    triangles: reads those (F, 3) of the mesh, if they are needed
    """
    painted = read(mesh)
    protected = np.zeros(len(mesh.vertices), np.float32)
    if MASK in painted:
        protected = np.clip(np.nan_to_num(painted[MASK]), 0, 1)
    if HIDDEN_VERTEX in painted:
        protected[painted[HIDDEN_VERTEX]] = 1
    if HIDDEN_FACE in painted:
        protected[triangles(mesh)[painted[HIDDEN_FACE]]] = 1
    return protected if protected.any() else None
