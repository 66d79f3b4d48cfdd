# SPDX-License-Identifier: GPL-3.0-or-later
"""Final results, which replace the quick results that a stroke's undo step holds.

A quick result is an undo step; the final one that follows is not. So Blender's undo, redo and
copies bring the quick result back, and whoever shows one gets its final result from here, as long
as it is remembered. Undo can also bring back only one of object and mesh, when the other did not
change between two undo steps: they are told apart by the mesh's fingerprint.
"""

from collections import OrderedDict
from dataclasses import dataclass

import bpy
from bpy.types import Object

from ..worker.client import Message
from . import proxy_mesh
from .commit import show
from .properties import field_of, is_field

BYTES = 128 << 20
"""Of all final results together; some 5 MB each with 100,000 triangles."""


@dataclass(frozen=True)
class Final:
    """What belongs to one quick result.

    quick, shown:   its revision, and the fingerprint of its mesh
    result, meshed: the final result, and the fingerprint of its mesh
    """

    quick: str
    shown: int
    result: Message
    meshed: int

    @property
    def revision(self) -> str:
        """Of the final weights."""
        return self.result.fields["revision"]

    @property
    def bytes(self) -> int:
        """In memory."""
        return sum(array.nbytes for array in self.result.arrays.values())


class Finals:
    """The final results of one Blender file, the oldest of which are forgotten."""

    def __init__(self) -> None:
        """None is known yet."""
        self._known: OrderedDict[str, Final] = OrderedDict()  # by the revision of the quick result

    def remember(self, quick: Message, result: Message) -> None:
        """`result` is the final one of `quick`."""
        revision = quick.fields["revision"]
        shown, meshed = (proxy_mesh.fingerprint(m.arrays["vertices"]) for m in (quick, result))
        self._known[revision] = Final(revision, shown, result, meshed)
        while sum(final.bytes for final in self._known.values()) > BYTES:
            self._known.popitem(last=False)

    def forget(self) -> None:
        """Another file is opened."""
        self._known.clear()

    def successor(self, revision: str) -> str:
        """The revision that replaces this one, or itself."""
        final = self._known.get(revision)
        return revision if final is None else final.revision

    def bring(self) -> None:
        """Show the final result wherever a quick one is shown.

        A mesh that something else has changed is left alone with its quick result, and so is one
        that is locked, or shared: it would need a copy, which is made in an undo step only.
        """
        if not self._known:
            return
        by_revision = {final.revision: final for final in self._known.values()} | self._known
        for ob in bpy.data.objects:
            final = by_revision.get(field_of(ob).revision) if is_field(ob) else None
            if final is None or proxy_mesh.why_locked(ob) or _is_shared(ob):
                continue
            mesh = proxy_mesh.fingerprint(proxy_mesh.positions(ob))
            settled = field_of(ob).revision == final.revision and mesh == final.meshed
            if mesh in (final.shown, final.meshed) and not settled:
                show(ob, final.result)


def _is_shared(ob: Object) -> bool:
    return ob.data is not None and ob.data.users > 1
