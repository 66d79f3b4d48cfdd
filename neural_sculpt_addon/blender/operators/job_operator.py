# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared parts of operators that start jobs of the worker: when they may run, how they start."""

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, TypeAlias, TypeVar, cast

from bpy.types import Context, Object, Operator

from ...common.errors import SculptError
from ...common.text import Text
from ...stroke.stroke import Stroke
from ..locale.translations import translated
from ..scene.mesh import proxy_mesh
from ..scene.mesh.protect import protected, protected_each
from ..scene.properties import is_field
from ..session.job import Job
from ..session.stroke_jobs import edit_job
from ..session.worker_session import session

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import OperatorReturnItems, OperatorTypeFlagItems

Outcome: TypeAlias = "set[OperatorReturnItems]"
Execute = TypeVar("Execute", bound=Callable[..., Outcome])

FINISHED: Outcome = {"FINISHED"}
CANCELLED: Outcome = {"CANCELLED"}

REGISTER: "set[OperatorTypeFlagItems]" = {"REGISTER"}
"""Options of operators that the artist calls. UNDO is not among them, for the commit of a result
pushes the undo step."""
INTERNAL: "set[OperatorTypeFlagItems]" = {"INTERNAL"}
"""Options of operators that only buttons call."""


def launch(operator: Operator, job: Job) -> Outcome:
    """Start a job. In a window the operator ends at once, in the background when the job has
    ended."""
    try:
        session.run(job)
    except SculptError as error:
        return fail(operator, error)
    return FINISHED


def launch_strokes(operator: Operator, ob: Object, strokes: tuple[Stroke, ...]) -> Outcome:
    """Have strokes sculpted where nothing is masked or hidden now.

    The artist is told which strokes lie wholly under a mask: they are left out. SculptError when
    all of them do.
    """
    if len(strokes) == 1:
        return launch(operator, edit_job(ob, (protected(ob, strokes[0]),)))
    each = protected_each(ob, strokes)
    kept = tuple(stroke for stroke in each if stroke is not None)
    if not kept:
        raise SculptError(
            "All that the strokes would change is masked or hidden. Clear the mask, and try again."
        )
    outcome = launch(operator, edit_job(ob, kept))
    masked = [str(number) for number, stroke in enumerate(each, 1) if stroke is None]
    if masked:
        told = Text(
            "All that stroke {} would change is masked or hidden; it was left out.", masked[0]
        )
        if len(masked) > 1:
            numbers = ", ".join(masked)
            told = Text(
                "All that the strokes {} would change is masked or hidden; they were left out.",
                f"{numbers:.100}",
            )
        operator.report({"WARNING"}, translated(told))
    return outcome


def fail(operator: Operator, error: SculptError | str) -> Outcome:
    """Tell the artist what happened and what to do."""
    operator.report({"ERROR"}, translated(error.text if isinstance(error, SculptError) else error))
    return CANCELLED


def reports_errors(execute: Execute) -> Execute:
    """Let an operator's `execute` raise SculptError, of which the artist is told."""

    @wraps(execute)
    def executed(self: Operator, context: Context) -> Outcome:
        try:
            return execute(self, context)
        except SculptError as error:
            return fail(self, error)

    return cast(Execute, executed)


def refuse(cls: type[Operator], reason: str) -> bool:
    """The answer of a poll: no, and a sentence beside the grey button that says why."""
    cls.poll_message_set(translated(reason))
    return False


def field_poll(cls: type[Operator], context: Context) -> bool:
    """Whether the active object is a neural field; a grey button says that it is not."""
    if is_field(context.active_object):
        return True
    return refuse(cls, "Select a neural field first")


def editable_poll(cls: type[Operator], context: Context) -> bool:
    """Whether the active object is a neural field whose proxy can be replaced now."""
    if not field_poll(cls, context):
        return False
    if reason := proxy_mesh.why_locked(active_field(context)):
        return refuse(cls, reason)
    return True


def active_field(context: Context) -> Object:
    """The active object, which `field_poll` has seen to be a field."""
    ob = context.active_object
    assert ob is not None
    return ob
