# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs that undo cancelled, and the borders in Blender's history at which redo brings them back.

Undo takes back a change that has no result yet by cancelling its job, and Blender's own undo is
given a border to take back. Each further job needs another border behind it, so all are pushed
anew: a step cuts off what could be redone before. So does a result that comes meanwhile, of a job
that was not undone; after that the borders are pushed once more.

    two strokes wait, undo, undo    ...; to redo: border (One), border (Two)
    redo                            ..., border; to redo: border (Two)

Where something else can be redone already, a border would cut that off. There, instead, a step is
redone first, which Blender's undo then takes back; ahead of redo a step is undone in the same way:

    a stroke waits, a brush stroke, undo, undo    ...; to redo: the brush stroke
    redo, redo                                    the stroke waits again; the brush stroke
"""

import logging

import bpy

from ..scene import native_steps, sculpt_steps
from ..scene.mesh.preview import preview
from ..scene.sculpt_steps import BORDER, Step
from ..scene.undo_step import push_undo
from .job import Job

log = logging.getLogger(__name__)


class Undone:
    """The cancelled jobs that redo can bring back."""

    def __init__(self) -> None:
        """There are none."""
        self._jobs: list[Job] = []  # the next one last
        self._borders: list[Step] = []  # the next one first
        self._place: tuple[Step, list[Step]] | None = None
        """Where the jobs were undone without borders: the step, and what can be redone there."""
        self._steps_aside = False

    def forget(self) -> None:
        """Redo brings nothing back."""
        self._jobs.clear()
        self._borders.clear()
        self._place = None

    def is_next(self) -> bool:
        """Whether redo would bring a job back now."""
        if not self._jobs:
            return False
        before, after = sculpt_steps.steps()
        if self._place is not None:
            return (before[-1], after) == self._place
        return after == self._borders

    def has_borders(self) -> bool:
        """Whether redo would bring jobs back, and nothing else."""
        return self._place is None and self.is_next()

    def take(self, job: Job) -> None:
        """Keep a job that was cancelled because of undo. Undo then takes back its border, or the
        step that is redone here for that."""
        if not self.is_next():
            self.forget()
        before, after = sculpt_steps.steps()
        if job.rests and after and after != self._borders and len(before) > 1:
            self._jobs.append(job)
            self._place = before[-1], after
            with native_steps.ours():
                bpy.ops.ed.redo()
            return
        self._jobs.append(job)
        self._push()
        self._step_back(len(self._jobs) - 1)

    def cut_off(self) -> None:
        """The artist goes on where jobs were undone without borders."""
        if self._place is not None:
            self.forget()

    def step_aside(self) -> None:
        """Before a redo that is to bring back a job without a border: take back a step, so that
        redo comes to the same place."""
        if self._place is not None:
            self._steps_aside = True
            self._step_back(1)

    def bring_back(self) -> list[Job]:
        """The jobs whose borders, or whose place, redo has just reached, in order: one, or more
        after a jump in Blender's menu of its history."""
        if self._steps_aside:
            self._steps_aside = False
            return self._take_out(1 if self.is_next() else len(self._jobs))
        before, after = sculpt_steps.steps()
        count = len(self._borders) - len(after)
        if count < 1 or [*before[-count:], *after] != self._borders:
            return []
        del self._borders[:count]
        return self._take_out(count)

    def _take_out(self, count: int) -> list[Job]:
        return [self._jobs.pop() for _ in range(count)]

    def push_again(self) -> None:
        """Push the borders again, after a new step of Blender's history has cut them off. While an
        operator runs they are forgotten instead: undo must not be called then, and the operator's
        own step would cut them off.
        """
        windows = bpy.context.window_manager.windows
        if any(len(window.modal_operators) for window in windows):
            self.forget()
            return
        self._place = None
        self._push()
        self._step_back(len(self._jobs))
        preview.show()

    def _push(self) -> None:
        for _ in self._jobs:
            push_undo(BORDER)
        self._borders = sculpt_steps.steps()[0][-len(self._jobs) :]

    def _step_back(self, count: int) -> None:
        with native_steps.ours():
            for _ in range(count):
                bpy.ops.ed.undo()
