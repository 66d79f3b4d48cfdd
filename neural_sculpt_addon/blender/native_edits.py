# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a proxy was changed by Blender's own brushes and tools, which its field knows nothing of.

The next proxy that the worker makes takes its place, and such edits would be gone; Absorb fits the
field to them first.
"""

import numpy as np
from bpy.types import Mesh, Object

from . import preview, proxy_mesh

WARNING = (
    "The proxy was sculpted by other brushes, which the field does not know of."
    " Absorb takes that into the field; anything else would lose it."
)


def edited(ob: Object) -> bool:
    """Whether the proxy of a field differs from what the field gave; some 1 ms."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    filled = mesh.get(proxy_mesh.FILLED)
    if filled is None or mesh.is_editmode:
        return False
    shown = preview.TRUE["position"]  # there while the mesh shows more than its field has
    attribute = mesh.attributes[shown if shown in mesh.attributes else "position"]
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    attribute.data.foreach_get("vector", flat)  # pyright: ignore
    return filled != f"{proxy_mesh.fingerprint(flat):08x}"
