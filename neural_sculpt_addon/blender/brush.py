# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's brush settings frozen into a `stroke.Brush`."""

from bpy.types import Context

from ..stroke.brush import Brush
from ..stroke.modulation import Modulation
from ..stroke.profile import Profile
from . import curve_store
from .properties import CURVE, brush_of


def current_brush(context: Context) -> Brush:
    """The brush as the panel shows it; lengths in model space."""
    settings = brush_of(context)
    if settings.profile == CURVE:
        profile = Profile(table=curve_store.table(settings.curves, curve_store.PROFILE))
    else:
        profile = Profile(settings.profile.lower())
    if settings.modulation == CURVE:
        modulation = Modulation(table=curve_store.table(settings.curves, curve_store.MODULATION))
    else:
        modulation = Modulation(settings.modulation.lower())
    return Brush(settings.radius, settings.intensity, profile, modulation)
