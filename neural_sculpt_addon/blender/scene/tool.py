# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool that draws strokes, in Blender's toolbar, and whether the artist holds it."""

from typing import Any

from bpy.types import WorkSpace

TOOL = "neural_sculpt.tool"
"""The name that Blender knows it by."""


def holds_tool(workspace: WorkSpace, mode: Any) -> bool:
    """Whether our tool is the active one of a workspace in a mode, as of `Context.mode`."""
    tool = workspace.tools.from_space_view3d_mode(mode, create=False)
    return tool is not None and tool.idname == TOOL
