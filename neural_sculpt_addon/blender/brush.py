# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's brush settings frozen into a `stroke.Brush`."""

from collections.abc import Sequence

import numpy as np
from bpy.types import Context, NodeTree
from numpy.typing import NDArray

from ..stroke.brush import Brush
from ..stroke.modulation import Modulation
from ..stroke.profile import Profile
from . import curve_store
from .properties import CURVE, brush_of


def current_brush(context: Context) -> Brush:
    """The brush as the panel shows it; lengths in model space."""
    settings = brush_of(context)
    return Brush(
        settings.radius,
        settings.intensity,
        profile(settings.profile, settings.curves),
        modulation(settings.modulation, settings.curves),
    )


def profile(choice: str, curves: NodeTree) -> Profile:
    """What a choice of profile means; `curves` are needed for CURVE alone."""
    if choice == CURVE:
        return Profile(table=curve_store.table(curves, curve_store.PROFILE))
    return Profile(choice.lower())


def modulation(choice: str, curves: NodeTree) -> Modulation:
    """What a choice of modulation means; `curves` are needed for CURVE alone."""
    if choice == CURVE:
        return Modulation(table=curve_store.table(curves, curve_store.MODULATION))
    return Modulation(choice.lower())


def pressure_factors(context: Context, length: str, pressures: Sequence[float]) -> NDArray | None:
    """Factors (K,) of "radius" or "intensity" for pressures (K,) in [0, 1].

    None when the pen's pressure does not change it; linear until its curve was made.
    """
    settings = brush_of(context)
    word = f"pressure_{length}"
    if not getattr(settings, word):
        return None
    if settings.curves is None:
        return np.asarray(pressures, float)
    table = curve_store.table(settings.curves, word)
    return np.interp(pressures, np.linspace(0, 1, len(table)), table)
