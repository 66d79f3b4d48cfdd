# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist has chosen: an entry of a history, and the tool that draws strokes.

An entry is chosen in the list or on the surface, and shown there until the history changes. One
that the history made active by itself, such as a new stroke, does not count.
"""

from typing import Any

from bpy.types import Context, Object, WorkSpace

TOOL = "neural_sculpt.tool"
"""The name that Blender knows the tool by, in its toolbar."""


class _State:
    chosen: tuple[int, int] | None = None  # session_uid of the object, place in its history


def choose(group: Any, context: Context) -> None:
    """Note the entry that the artist has pointed at: the update of `active_stroke`."""
    ob = group.id_data
    _State.chosen = ob.session_uid, group.active_stroke


def forget() -> None:
    """Choose none, for the history has changed."""
    _State.chosen = None


def is_chosen(ob: Object, place: int) -> bool:
    """Whether the artist has pointed at the entry at that place of the object's history."""
    return _State.chosen == (ob.session_uid, place)


def holds_tool(workspace: WorkSpace, mode: Any) -> bool:
    """Whether our tool is the active one of a workspace in a mode, as of `Context.mode`."""
    tool = workspace.tools.from_space_view3d_mode(mode, create=False)
    return tool is not None and tool.idname == TOOL
