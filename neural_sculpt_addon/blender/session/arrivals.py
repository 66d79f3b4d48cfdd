# SPDX-License-Identifier: GPL-3.0-or-later
"""What came from the worker and still has to reach the scene, piece by piece between two polls.

The session knows nothing of what these pieces are: `brush_results` has some.
"""

from .job import Job


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
        """Whether something is being done of which one may come that a job must know of."""
        return False

    def follow(self, job: Job) -> None:
        """The result of a job has come into the scene."""
