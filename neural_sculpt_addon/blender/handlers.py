# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's undo, redo, load and save, as far as the worker and the previews must know of them.

The object's properties are the truth and Blender restores them together with the proxy mesh. This
is left to do:

    pass over borders (see `sculpt_steps`)
    take back, and bring back, changes that have no result yet
    show the reports that came after the undo step of their stroke
    cancel the jobs whose base is no longer there
    let undo leave Sculpt Mode (see `sculpt_mode`)
    keep previews out of undo steps and files
"""

from collections.abc import Callable

import bpy
from bpy.app.handlers import persistent

from ..common.errors import SculptError
from . import notice
from .panels import strength
from .scene import kept_steps, native_steps, sculpt_mode, sculpt_steps
from .scene.mesh.preview import preview
from .scene.undo_step import in_partial_mode, in_window
from .session import reports, saved_strokes
from .session.absorption import brush_results, live
from .session.worker_session import session


class _State:
    passing: bool = False  # over a border, by an undo or redo of ours


@persistent
def prepare_undo(*_: object) -> None:
    """Leave a border before undo.

    If the artist's last change has no result yet, and Blender's history no step after it, undo
    means that change: its job is cancelled, and Blender's own undo is given a border to take back.
    """
    if native_steps.is_ours():
        return
    live.expect_no_stroke()
    if not _State.passing:
        brush_results.finish()
    preview.hide()
    if _State.passing:
        return
    strength.finish()
    if not in_partial_mode() and (job := session.newest_change()) is not None:
        session.cancel_job(job, f"{job.label:.100} was undone.")
        session.undone.take(job)
        return
    while sculpt_steps.undo_passes() and _pass(bpy.ops.ed.undo):
        pass


@persistent
def prepare_redo(*_: object) -> None:
    """Redo the steps that nobody asked for ahead of the one that redo is to reach."""
    if native_steps.is_ours():
        return
    live.expect_no_stroke()
    if not _State.passing:
        brush_results.finish(unless_undone=True)
    preview.hide()
    if not _State.passing:
        for _place in range(sculpt_steps.redo_passes()):
            if session.undone.is_next() or not _pass(bpy.ops.ed.redo):
                break
        if session.undone.is_next():
            session.undone.step_aside()


def _pass(step: Callable[[], object]) -> bool:
    """Take a step of Blender's history; whether it led to another one."""
    before = sculpt_steps.active()
    _State.passing = True
    try:
        with in_window():
            step()
    finally:
        _State.passing = False
    return sculpt_steps.active() != before


@persistent
def hide(*_: object) -> None:
    """Hide the previews of a file that Blender saved by itself, after it was loaded."""
    preview.hide()


@persistent
def prepare_file(*_: object) -> None:
    """Make a file whole, before it is saved: normals, true positions, strokes that wait."""
    kept_steps.settle()
    preview.hide()
    saved_strokes.add()


@persistent
def show(*_: object) -> None:
    """Show what was hidden for the file, after it was saved or could not be."""
    saved_strokes.remove()
    preview.show()


@persistent
def follow(*_: object) -> None:
    """Follow Blender's history after undo and redo: jobs, reports, previews."""
    if _State.passing or native_steps.is_ours():
        return
    preview.hide()  # a step that Blender made by itself may hold one
    live.leave()
    session.follow_history()
    reports.follow()
    preview.show()
    if (ob := bpy.context.active_object) is not None and not session.jobs:
        reports.measure_again(ob)


@persistent
def bring_back(*_: object) -> None:
    """After redo, have done again what undo has cancelled: absorbing strokes, or another job."""
    if _State.passing or native_steps.is_ours():
        return
    session.arrivals.come_again()
    jobs = session.undone.bring_back()
    before = sculpt_steps.steps()[0]
    if jobs and len(before) > len(jobs) and before[-1].name == sculpt_steps.BORDER:
        session.move_on(before[-1 - len(jobs)], before[-1])
    for job in jobs:
        try:
            session.submit_again(job)
        except SculptError as error:
            notice.tell(error.text)


@persistent
def note_mode(*_: object) -> None:
    """A mode may have been entered."""
    if bpy.context.window is not None:  # while a file is saved, Blender draws a picture of it
        sculpt_mode.note()


@persistent
def leave(*_: object) -> None:
    """Let go of what belonged to the file before, when another one was loaded. One that cannot be
    read leaves everything as it is."""
    preview.let_go()
    live.forget()
    session.leave_file()


_HANDLERS = (
    ("depsgraph_update_post", note_mode),
    ("undo_pre", prepare_undo),
    ("redo_pre", prepare_redo),
    ("undo_post", follow),
    ("redo_post", follow),
    ("redo_post", bring_back),
    ("save_pre", prepare_file),
    ("save_post", show),
    ("save_post_fail", show),
    ("load_post", leave),
    ("load_post", hide),
)


def register() -> None:
    """Listen to Blender's history."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
