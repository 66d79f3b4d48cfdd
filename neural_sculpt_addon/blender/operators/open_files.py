# SPDX-License-Identifier: GPL-3.0-or-later
"""Open the extension's own files in the programs that the system has for them."""

import bpy
from bpy.types import Context, Operator

from ..folders import log_file, preset_folder
from .job_operator import FINISHED, INTERNAL, Outcome, refuse


class NEURAL_SCULPT_OT_open_log(Operator):
    """Open the file in which the worker writes what it does"""

    bl_idname = "neural_sculpt.open_log"
    bl_label = "Open Log"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """There is one."""
        if log_file().is_file():
            return True
        return refuse(cls, "There is no log before the worker's first start")

    def execute(self, context: Context) -> Outcome:
        """Open it."""
        bpy.ops.wm.path_open(filepath=str(log_file()))
        return FINISHED


class NEURAL_SCULPT_OT_open_presets(Operator):
    """Open the folder of your own presets, whose files can be shared"""

    bl_idname = "neural_sculpt.open_presets"
    bl_label = "Open Preset Folder"
    bl_options = INTERNAL

    @classmethod
    def poll(cls, context: Context) -> bool:
        """There is one."""
        if preset_folder().is_dir():
            return True
        return refuse(cls, "No presets of your own yet")

    def execute(self, context: Context) -> Outcome:
        """Open it."""
        bpy.ops.wm.path_open(filepath=str(preset_folder()))
        return FINISHED
