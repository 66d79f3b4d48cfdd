# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sees of the session's work: panels, status bar, notices, strokes on the proxy.

In a window a timer polls the session. Timers never run in the background, where a script waits for
its jobs.
"""

from collections.abc import Mapping, Sequence

import bpy

from ...stroke.stroke import Stroke
from ...worker.client import Message, WorkerState
from .. import notice, redraw
from ..scene.mesh.preview import preview
from ..session import reports
from ..session.absorption.tracked_proxies import is_at_work
from ..session.job import Job
from ..session.session_hooks import Watcher
from ..session.worker_session import session
from . import status_bar

TICK = 0.005  # seconds between two polls in a window, whose own loop is no faster


class SessionDisplay(Watcher):
    """Shows what it hears of the session."""

    def __init__(self) -> None:
        """Nothing is shown yet."""
        self.timer = self._tick  # one object, as Blender knows a timer by it
        self._told = False, 0  # of a slow job and of strokes that wait, in the status bar

    def work_came(self) -> None:
        """Poll from now on."""
        if not bpy.app.background and not bpy.app.timers.is_registered(self.timer):
            bpy.app.timers.register(self.timer, persistent=True)

    def stopped(self) -> None:
        """Poll no more."""
        if bpy.app.timers.is_registered(self.timer):
            bpy.app.timers.unregister(self.timer)

    def changed(self) -> None:
        """Draw the panels again."""
        redraw.tag_panels()

    def ended(self, job: Job) -> None:
        """Draw no more of the job. The last stroke is measured now if the job came before that,
        unless another one is being drawn."""
        redraw.tag_panels()
        if job.preview is not None:
            redraw.tag_views()
        if not is_at_work():
            reports.measure_at_rest()

    def warned(self, message: str) -> None:
        """Tell the artist."""
        notice.tell(message)

    def polled(self) -> None:
        """Follow the artist's modes and tools."""
        preview.refresh()

    def strokes_wait(self, strokes: Mapping[int, Sequence[Stroke]]) -> None:
        """Show the strokes on their proxies."""
        preview.want(strokes)

    def prepare(self, target: int, result: Message, strokes: Sequence[Stroke]) -> bool:
        """Displace one of the strokes on the proxy that the result brings."""
        return preview.foresee(
            target, result.arrays["vertices"], result.arrays["triangles"], strokes
        )

    def _tick(self) -> float | None:
        before = session.worker.state
        heard = session.poll_once()
        now = session.worker.state
        if heard or now is not before:
            redraw.tag_panels()
        slow = session.slow_job() is not None
        told, self._told = self._told, (slow, status_bar.strokes_that_wait())
        if told != self._told or (slow and (heard or now is not before)):
            status_bar.refresh()
        busy = not session.rests or session.behind or now is WorkerState.STARTING
        return TICK if busy else None


def register() -> None:
    """Show what the session does."""
    session.watcher = SessionDisplay()


def unregister() -> None:
    """Show it no more; the session is stopped."""
    preview.give_up()
    session.watcher = Watcher()
