# SPDX-License-Identifier: GPL-3.0-or-later
"""A job for the worker: one request, on which object, and what becomes of its result."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from ...stroke.stroke import Stroke
from ...worker.client import JobKind, Message
from ..locale.translations import translated
from ..scene.sculpt_steps import Step


@dataclass(frozen=True)
class Request:
    """What a job asks of the worker, as the protocol names it.

    held: reads bytes by their id; they are sent unless the worker has them
    kind: where it depends on what the object is when the job's turn comes
    """

    fields: dict[str, Any]
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    held: dict[str, Callable[[], bytes]] = field(default_factory=dict)
    kind: JobKind | None = None


class JobStatus(StrEnum):
    """Where a job is between its submission and its end."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(eq=False)
class Job:
    """One request to the worker and what to do with its result.

    label:   what the artist reads beside the progress bar
    request: makes the request when the job's turn comes
    apply:   takes the result on the main thread; raises SculptError when it cannot
    target:  session_uid of the object that the job edits, None when it edits none
    reads:   session_uid of the object whose field a job without a target reads
    step:    the last step of Blender's history when the job was asked for, or the one that a result
             of an earlier job has made since
    follows: whether the change that the job computes, a brush stroke for example, is a step of
             Blender's history already
    rests:   whether undo or redo came since the job's stroke was drawn: its result then waits while
             something can be redone
    waits:   whether the result waits for that reason now
    base:    revision that the target must have; set when the job is first of those on its target
    strokes: what the proxy shows of the job until there is a result
    preview: shows what the result looks like so far
    told_why: hears why there is no result; only of a job that waits behind the others
    foresee: works some milliseconds at what `apply` needs; whether there is more to do
    keep:    puts the strokes into the history as muted, when they cannot be applied
    deaths:  how many workers died while they had the job; after the second it ends
    resent:  whether the worker lacked bytes that it should have had, and got all once more
    begun:   when the worker got it, on the clock of `time.monotonic`
    failure: why it failed, while its strokes cannot be put into the history yet
    """

    kind: JobKind
    label: str
    request: Callable[[], Request]
    apply: Callable[[Message], None]
    target: int | None = None
    reads: int | None = None
    step: Step | None = None
    follows: bool = False
    rests: bool = False
    waits: bool = False
    base: str = ""
    strokes: tuple[Stroke, ...] = ()
    preview: Callable[[Message], None] | None = None
    told_why: Callable[[str], None] | None = None
    foresee: Callable[[Message], bool] | None = None
    keep: Callable[[], None] | None = None
    deaths: int = 0
    status: JobStatus = JobStatus.QUEUED
    fraction: float = 0.0
    message: str = ""
    number: int = field(default=-1, repr=False)
    begun: float = field(default=0.0, repr=False)
    resent: bool = field(default=False, repr=False)
    failure: str = ""

    @property
    def title(self) -> str:
        """The label in the artist's language, as much of it as a sentence quotes."""
        return translated(self.label)[:100]

    @property
    def pending(self) -> bool:
        """Whether the job has no result yet."""
        return self.status in (JobStatus.QUEUED, JobStatus.RUNNING)
