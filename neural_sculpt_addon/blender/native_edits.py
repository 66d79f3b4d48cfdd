# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a proxy was changed by Blender's own brushes and tools, which its field knows nothing of.

The next proxy that the worker makes takes its place, and such edits would be gone: strokes and
changes of the history are refused until Absorb has fitted the field to them, or Remesh Proxy has
dropped them.
"""

import numpy as np
from bpy.types import Mesh, Object

from ..stroke.errors import SculptError
from . import preview, proxy_mesh


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


def refuse(ob: Object) -> None:
    """SculptError when a new proxy would lose what other brushes did."""
    if edited(ob):
        raise SculptError(
            "The proxy was sculpted by other brushes, which the field does not know of."
            " Absorb takes that into the field, Remesh Proxy drops it."
        )
