# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool that draws strokes, by the name that Blender knows it by."""

TOOL = "neural_sculpt.tool"
