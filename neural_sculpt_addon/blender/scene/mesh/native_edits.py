# SPDX-License-Identifier: GPL-3.0-or-later
"""Native edits: changes to a proxy by Blender's own brushes and tools, unknown to its field.

The next proxy that the worker makes takes its place, and such edits would be gone: strokes and
changes of the history are refused until Absorb has fitted the field to them, or Remesh Proxy has
dropped them. That is looked at when a job starts, and again when its result is there.
"""

from bpy.types import Mesh, Object

from ....common.errors import SculptError
from . import preview_attributes, proxy_mesh


def edited(ob: Object) -> bool:
    """Whether the proxy of a field differs from the mesh that the field has given, or is another
    mesh; some 1 ms."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    if mesh.is_editmode or not mesh.vertices:
        return False
    now = proxy_mesh.fill_mark(preview_attributes.true_positions(mesh))
    return now != mesh.get(proxy_mesh.FILLED)


def mark(ob: Object) -> int:
    """A number that changes with every native edit."""
    assert isinstance(ob.data, Mesh)
    return proxy_mesh.fingerprint(preview_attributes.true_positions(ob.data))


def refuse_since(ob: Object, before: int | None) -> None:
    """SculptError when the proxy's mark is no longer `before`."""
    if mark(ob) != before:
        raise SculptError(
            "The proxy was sculpted by other brushes meanwhile, so it was left as it is. Try again."
        )


def refuse(ob: Object) -> None:
    """SculptError when a new proxy would lose what other brushes did."""
    if edited(ob):
        raise SculptError(
            "The proxy is not as the field made it: other brushes or tools changed it."
            " Absorb takes that into the field, Remesh Proxy drops it. If it was Apply or Set"
            " Origin, undo that instead: Remesh Proxy would give the shape another size or place."
        )
