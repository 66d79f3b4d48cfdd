# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that Blender is told about, in order, and taken back in reverse."""

import bpy
from bpy.props import PointerProperty
from bpy.types import Brush, Object, Scene

from . import handlers, menus, tools
from .locale import translations
from .notice import NEURAL_SCULPT_OT_notice
from .operators.fields.absorb import NEURAL_SCULPT_OT_absorb
from .operators.fields.add import NEURAL_SCULPT_OT_add
from .operators.fields.apply_to_base import NEURAL_SCULPT_OT_apply_to_base
from .operators.fields.boolean import NEURAL_SCULPT_OT_boolean
from .operators.fields.choose_solver import NEURAL_SCULPT_OT_choose_solver
from .operators.fields.consolidate import NEURAL_SCULPT_OT_consolidate
from .operators.fields.export import NEURAL_SCULPT_OT_export
from .operators.fields.from_mesh import NEURAL_SCULPT_OT_from_mesh
from .operators.fields.remesh import NEURAL_SCULPT_OT_remesh
from .operators.fields.show_worst import NEURAL_SCULPT_OT_show_worst
from .operators.jobs import install_worker
from .operators.jobs.cancel import NEURAL_SCULPT_OT_cancel
from .operators.jobs.good_enough import NEURAL_SCULPT_OT_good_enough
from .operators.jobs.install_worker import (
    NEURAL_SCULPT_OT_cancel_installation,
    NEURAL_SCULPT_OT_install_worker,
)
from .operators.jobs.restart_worker import NEURAL_SCULPT_OT_restart_worker
from .operators.jobs.stop_worker import NEURAL_SCULPT_OT_stop_worker
from .operators.no_drag import NEURAL_SCULPT_OT_no_drag
from .operators.open_files import NEURAL_SCULPT_OT_open_log, NEURAL_SCULPT_OT_open_presets
from .operators.strokes.alpha_image import NEURAL_SCULPT_OT_alpha_image
from .operators.strokes.draw import NEURAL_SCULPT_OT_draw
from .operators.strokes.edit_stroke import NEURAL_SCULPT_OT_edit_stroke
from .operators.strokes.from_file import NEURAL_SCULPT_OT_strokes_from_file
from .operators.strokes.from_lines import NEURAL_SCULPT_OT_strokes_from_lines
from .operators.strokes.history import (
    NEURAL_SCULPT_OT_delete_stroke,
    NEURAL_SCULPT_OT_duplicate_stroke,
    NEURAL_SCULPT_OT_move_stroke,
    NEURAL_SCULPT_OT_mute_stroke,
    NEURAL_SCULPT_OT_set_strength,
    NEURAL_SCULPT_OT_solo_stroke,
)
from .operators.strokes.pick_stroke import NEURAL_SCULPT_OT_pick_stroke
from .operators.strokes.presets import (
    NEURAL_SCULPT_OT_delete_preset,
    NEURAL_SCULPT_OT_import_preset,
    NEURAL_SCULPT_OT_rename_preset,
    NEURAL_SCULPT_OT_save_preset,
)
from .operators.strokes.resize import NEURAL_SCULPT_OT_resize
from .operators.strokes.stroke import NEURAL_SCULPT_OT_stroke
from .operators.strokes.watch_release import NEURAL_SCULPT_OT_watch_release
from .panels import session_display, status_bar, strength
from .panels.brush import NEURAL_SCULPT_PT_brush, NEURAL_SCULPT_PT_pressure
from .panels.history import NEURAL_SCULPT_PT_history, NEURAL_SCULPT_UL_strokes
from .panels.model import NEURAL_SCULPT_PT_model
from .panels.preset_menus import (
    NEURAL_SCULPT_MT_alpha_images,
    NEURAL_SCULPT_MT_modulation_presets,
    NEURAL_SCULPT_MT_profile_presets,
)
from .panels.proxy import NEURAL_SCULPT_PT_proxy
from .panels.stroke import NEURAL_SCULPT_PT_stroke
from .panels.worker import NEURAL_SCULPT_PT_worker
from .preferences import NEURAL_SCULPT_AP_preferences
from .presets import alpha_choices, shape_choices
from .scene import sound_strings
from .scene.brush import kept_brush
from .scene.brush.brush_properties import NEURAL_SCULPT_PG_brush, NEURAL_SCULPT_PG_point
from .scene.mesh import seen_surface
from .scene.properties import GROUP, NEURAL_SCULPT_PG_field, NEURAL_SCULPT_PG_listed_stroke
from .session import saved_strokes
from .session.absorption import live
from .session.worker_session import session
from .viewport import changed_stroke, fit_overlay, overlay, worst_place

CLASSES = (
    NEURAL_SCULPT_AP_preferences,
    NEURAL_SCULPT_PG_listed_stroke,
    NEURAL_SCULPT_PG_field,
    NEURAL_SCULPT_PG_brush,
    NEURAL_SCULPT_PG_point,
    NEURAL_SCULPT_OT_add,
    NEURAL_SCULPT_OT_from_mesh,
    NEURAL_SCULPT_OT_draw,
    NEURAL_SCULPT_OT_no_drag,
    NEURAL_SCULPT_OT_pick_stroke,
    NEURAL_SCULPT_OT_resize,
    NEURAL_SCULPT_OT_stroke,
    NEURAL_SCULPT_OT_strokes_from_lines,
    NEURAL_SCULPT_OT_strokes_from_file,
    NEURAL_SCULPT_OT_mute_stroke,
    NEURAL_SCULPT_OT_solo_stroke,
    NEURAL_SCULPT_OT_set_strength,
    NEURAL_SCULPT_OT_delete_stroke,
    NEURAL_SCULPT_OT_duplicate_stroke,
    NEURAL_SCULPT_OT_move_stroke,
    NEURAL_SCULPT_OT_edit_stroke,
    NEURAL_SCULPT_OT_apply_to_base,
    NEURAL_SCULPT_OT_absorb,
    NEURAL_SCULPT_OT_boolean,
    NEURAL_SCULPT_OT_choose_solver,
    NEURAL_SCULPT_OT_consolidate,
    NEURAL_SCULPT_OT_show_worst,
    NEURAL_SCULPT_OT_alpha_image,
    NEURAL_SCULPT_OT_save_preset,
    NEURAL_SCULPT_OT_rename_preset,
    NEURAL_SCULPT_OT_delete_preset,
    NEURAL_SCULPT_OT_import_preset,
    NEURAL_SCULPT_OT_open_presets,
    NEURAL_SCULPT_OT_open_log,
    NEURAL_SCULPT_OT_remesh,
    NEURAL_SCULPT_OT_export,
    NEURAL_SCULPT_OT_cancel,
    NEURAL_SCULPT_OT_good_enough,
    NEURAL_SCULPT_OT_restart_worker,
    NEURAL_SCULPT_OT_stop_worker,
    NEURAL_SCULPT_OT_notice,
    NEURAL_SCULPT_OT_watch_release,
    NEURAL_SCULPT_OT_install_worker,
    NEURAL_SCULPT_OT_cancel_installation,
    NEURAL_SCULPT_PT_model,
    NEURAL_SCULPT_MT_profile_presets,
    NEURAL_SCULPT_MT_modulation_presets,
    NEURAL_SCULPT_MT_alpha_images,
    NEURAL_SCULPT_PT_brush,
    NEURAL_SCULPT_PT_pressure,
    NEURAL_SCULPT_PT_stroke,
    NEURAL_SCULPT_UL_strokes,
    NEURAL_SCULPT_PT_history,
    NEURAL_SCULPT_PT_proxy,
    NEURAL_SCULPT_PT_worker,
)


PARTS = (
    sound_strings,
    session_display,
    handlers,
    live,
    kept_brush,
    seen_surface,
    menus,
    status_bar,
    strength,
    overlay,
    changed_stroke,
    fit_overlay,
    worst_place,
    tools,
)
"""What is registered after the classes and the properties."""


def register() -> None:
    """Tell Blender."""
    translations.register()
    shape_choices.register()
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    setattr(Object, GROUP, PointerProperty(type=NEURAL_SCULPT_PG_field))
    setattr(Brush, GROUP, PointerProperty(type=NEURAL_SCULPT_PG_brush))
    setattr(Scene, GROUP, PointerProperty(type=NEURAL_SCULPT_PG_brush))
    for part in PARTS:
        part.register()


def unregister() -> None:
    """Stop the worker and take everything back. Strokes that wait stay in the history, muted."""
    saved_strokes.leave()
    session.stop()
    install_worker.stop()
    for part in reversed(PARTS):
        part.unregister()
    delattr(Scene, GROUP)
    delattr(Brush, GROUP)
    delattr(Object, GROUP)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    alpha_choices.unregister()
    shape_choices.unregister()
    translations.unregister()
