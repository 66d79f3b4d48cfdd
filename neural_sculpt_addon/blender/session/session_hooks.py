# SPDX-License-Identifier: GPL-3.0-or-later
"""Hooks of the session: a `Watcher` is told of its work, to show it; `Arrivals` is asked for
results that are on their way into the scene.

The session knows nothing of windows, panels and previews, nor of brushes: `session_display` listens
to it, and `brush_results` brings results into the scene piece by piece, between two polls.
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
        """Prepare the preview of strokes that still wait, on the proxy that a result will bring.
        True when there was something to do: the result is then shown by a later poll.
        """
        return False


class Arrivals:
    """Results that are on their way into the scene. Here there are none."""

    def wait(self) -> bool:
        """Whether there is a piece that `take` would bring into the scene now."""
        return False

    def take(self) -> bool:
        """Bring a piece into the scene; whether there was one. Raises nothing."""
        return False

    def hold(self, job: Job) -> bool:
        """Whether a job must not begin before they are there."""
        return False

    def may_come(self, job: Job) -> bool:
        """Whether the artist is doing something that must end before a job changes the scene, or
        that may become a result which the job must take into account."""
        return False

    def follow(self, job: Job) -> None:
        """The result of a job has come into the scene."""

    def come_again(self) -> None:
        """Redo has brought back a state of the scene, and `follow_history` is done."""
