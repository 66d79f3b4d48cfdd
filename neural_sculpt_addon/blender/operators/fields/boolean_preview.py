# SPDX-License-Identifier: GPL-3.0-or-later
"""Preview of a Boolean while its dialog is open.

    other settings -> a job behind all others -> a coarse mesh -> over the scene

When settings change in quick succession, only the last ones are computed; until then the mesh of
the previous settings stays in sight. A mesh is removed when the field has changed since it was
made, whatever becomes of the dialog. If a Boolean is impossible, the status bar says why.
"""

from collections.abc import Callable
from dataclasses import dataclass

from bpy.types import Object

from ....common.errors import SculptError
from ....worker.client import JobKind, Message
from ... import redraw
from ...locale.translations import translated
from ...panels import status_bar
from ...scene.properties import field_of, find, found
from ...session import reports
from ...session.job import Job, Request
from ...session.worker_session import session
from ...viewport import fit_overlay

Asked = tuple[object, ...]
"""The settings that a preview depends on."""


@dataclass(frozen=True)
class _Preview:
    asked: Asked
    job: Job


class _State:
    now: _Preview | None = None


def show(ob: Object, asked: Asked, request: Callable[[], Request]) -> None:
    """Preview the Boolean of `request`, unless it equals the last one that was asked for."""
    target, revision = ob.session_uid, field_of(ob).revision
    asked = (*asked, target, revision)
    if _State.now is not None and _State.now.asked == asked:
        return

    def holds() -> bool:
        """Whether this mesh is still the one to show: no other one has been computed or asked
        for."""
        ob, now = find(target), _State.now
        if ob is None or now is None or (field_of(ob).revision, ob.mode) != (revision, "OBJECT"):
            return False
        return now.asked == asked or session.behind is now.job

    def apply(result: Message) -> None:
        fit_overlay.show(result, found(target).matrix_world, holds, on_top=True)
        status_bar.show_hint(None)

    job = Job(JobKind.BOOLEAN_MESH, "Preview", request, apply, told_why=_tell)
    _State.now = _Preview(asked, job)
    try:
        session.submit_behind(job, start=True)
    except SculptError as error:
        _tell(error.text)


def _tell(why: str) -> None:
    status_bar.show_hint(translated(why))
    redraw.tag_views()


def end(ob: Object | None = None) -> None:
    """End the preview, for its dialog is closed.

    ob: the field, whose last stroke is measured now if the preview kept it from that
    """
    if (now := _State.now) is None:
        return
    _State.now = None
    status_bar.show_hint(None)
    if session.behind is now.job:
        session.drop_behind()
    if ob is not None and not session.jobs:
        reports.measure_again(ob)
    redraw.tag_views()
