# SPDX-License-Identifier: GPL-3.0-or-later
"""The job that absorbs a proxy as a whole, whatever was done to it."""

from dataclasses import replace

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Mesh, Object

from ....common.errors import SculptError
from ....worker.client import JobKind, Message
from ...scene.commit import add_entry, new_revision
from ...scene.mesh import native_edits, proxy_mesh
from ...scene.properties import field_of, found, shown_as
from ...scene.stroke_list import SCULPTED, Entry
from .. import states
from ..job import Job, Request

LABEL = n_("Absorb")


def absorb_job(ob: Object, follows: bool = False) -> Job:
    """The job that makes one layer of all that differs between the proxy and the field.

    follows: see `Job`
    """
    target = ob.session_uid
    absorbed: list[int] = []

    def request() -> Request:
        ob = found(target)
        if not native_edits.edited(ob):
            raise SculptError("The proxy is as the field made it; there is nothing to absorb.")
        assert isinstance(ob.data, Mesh)
        absorbed.append(native_edits.mark(ob))
        vertices, triangles = proxy_mesh.read(ob.data)
        asked = states.request(ob, **shown_as(field_of(ob)), result_revision=new_revision())
        return replace(asked, arrays={"vertices": vertices, "triangles": triangles})

    def apply(result: Message) -> None:
        ob = found(target)
        native_edits.refuse_since(ob, absorbed[-1])
        add_entry(ob, Entry("", iface_(SCULPTED)), result, LABEL)

    return Job(JobKind.ABSORB_PROXY, LABEL, request, apply, target=target, follows=follows)
