# SPDX-License-Identifier: GPL-3.0-or-later
"""What the session of the worker tells while it works, to whoever shows it.

The session knows nothing of windows, panels and previews: `session_display` listens to it.
"""

from collections.abc import Mapping, Sequence

from ...stroke.stroke import Stroke
from ...worker.client import Message
from .job import Job


class Watcher:
    """Hears what the session does. This one does nothing about it."""

    def work_came(self) -> None:
        """There is something to poll for."""

    def stopped(self) -> None:
        """There will be nothing to poll for."""

    def changed(self) -> None:
        """The jobs are others."""

    def ended(self, job: Job) -> None:
        """A job has ended."""

    def warned(self, message: str) -> None:
        """Something happened that the artist must know."""

    def polled(self) -> None:
        """The session is about to hear the worker's news."""

    def strokes_wait(self, strokes: Mapping[int, Sequence[Stroke]]) -> None:
        """These strokes have no result yet, by session_uid of their object, and no others."""

    def prepare(self, target: int, result: Message, strokes: Sequence[Stroke]) -> bool:
        """Prepare for a result that an object will be shown with, and strokes that still wait.

        True when there was something to do: the result is shown no sooner than by the next poll.
        """
        return False
