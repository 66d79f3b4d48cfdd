# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's brush settings frozen into a `stroke.Brush`, and strokes drawn with them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, Mesh, Object
from numpy.typing import ArrayLike, NDArray

from ....interaction.recorder import Point, StrokeRecorder
from ....stroke.alpha import Alpha
from ....stroke.brush import Brush
from ....stroke.modulation import Modulation
from ....stroke.profile import Profile
from ....stroke.stroke import Direction, Ends, Kind, Stroke
from ....stroke.symmetry import AXES, ONCE, Counts
from ...locale.translations import OURS
from ...presets import curve_store
from ...presets.alpha_choices import chosen_alpha
from ...presets.shape_choices import CURVE
from .brush_properties import brush_of

NARROWEST_FACTOR = 0.05
"""The least radius factor: a tube of no width has no surface."""


def current_kind(context: Context) -> Kind:
    """The kind of the next stroke."""
    return Kind[brush_of(context).kind]


def current_brush(context: Context, kind: Kind | None = None) -> Brush:
    """The brush as the panel shows it, or would for another kind, without its alpha; lengths in
    model space."""
    settings = brush_of(context)
    draws = (kind or current_kind(context)) is Kind.DRAW
    return Brush(
        settings.radius,
        settings.intensity if draws else settings.strength,
        profile(settings.profile),
        modulation(settings.modulation),
    )


def current_alpha(context: Context) -> Alpha | None:
    """The alpha of strokes that draw. SculptError when the image was not chosen yet."""
    settings = brush_of(context)
    return chosen_alpha(
        settings.alpha, settings.alpha_pixels, settings.alpha_angle, settings.alpha_spacing
    )


def profile(choice: str) -> Profile:
    """The profile of a choice; the right of its widget is the right of the stroke, v = -1."""
    if choice == CURVE:
        return Profile(table=curve_store.table(curve_store.PROFILE)[::-1])
    return Profile(choice.lower())


def modulation(choice: str) -> Modulation:
    """The modulation of a choice."""
    if choice == CURVE:
        return Modulation(table=curve_store.table(curve_store.MODULATION))
    return Modulation(choice.lower())


def pressure_factors(context: Context, length: str, pressures: Sequence[float]) -> NDArray | None:
    """Factors (K,) of "radius" or "intensity" for pressures (K,) in [0, 1].

    None when the pen's pressure changes nothing.
    """
    settings = brush_of(context)
    word = f"pressure_{length}"
    if not getattr(settings, word):
        return None
    table = curve_store.table(word)
    factors = np.interp(np.asarray(pressures, float), np.linspace(0, 1, len(table)), table)
    if length == "radius":
        factors = np.maximum(factors, NARROWEST_FACTOR)
    return None if (factors == 1).all() else factors


def seen(brush: Brush, kind: Kind) -> Brush:
    """The brush as it is drawn over the surface. Kinds other than Draw have no displacement, so
    their profile is flat."""
    return brush if kind is Kind.DRAW else replace(brush, intensity=0.0)


def brush_stroke(
    context: Context, ob: Object, points: ArrayLike, kind: Kind | None = None
) -> Stroke:
    """A stroke through points (K, 3) in model space, with the settings of the panel, or of another
    kind. SculptError when there can be none."""
    settings, kind = brush_of(context), kind or current_kind(context)
    alpha = current_alpha(context) if kind is Kind.DRAW else None
    return Stroke(
        np.asarray(points, float).reshape(-1, 3),
        replace(current_brush(context, kind), alpha=alpha),
        ends=Ends[settings.ends],
        direction=Direction[settings.direction],
        mirror=mirror_of(ob),
        radial=radial_of(context, ob),
        name="" if kind is Kind.DRAW else iface_(kind.title(), OURS),
        kind=kind,
    )


def drawn_stroke(
    context: Context, ob: Object, line: StrokeRecorder, inverted: bool, kind: Kind | None = None
) -> Stroke:
    """The stroke of a line drawn by hand, with the pen's pressure, as of `brush_stroke`."""
    stroke = brush_stroke(context, ob, line.points, kind)
    brush = stroke.brush
    return replace(
        stroke,
        brush=replace(brush, intensity=-brush.intensity) if inverted else brush,
        radius_factors=pressure_factors(context, "radius", line.pressures),
        intensity_factors=pressure_factors(context, "intensity", line.pressures),
    )


def strengths(stroke: Stroke) -> list[float]:
    """The pen's pressures (K,) at the control points of a stroke, estimated by the product of its
    two factors."""
    factors = (f for f in (stroke.radius_factors, stroke.intensity_factors) if f is not None)
    return np.prod([np.ones(len(stroke.points)), *factors], axis=0).tolist()


def redrawn_stroke(stroke: Stroke, points: Sequence[Point]) -> Stroke:
    """A stroke through other points; each is as wide and high as the nearest one was."""
    now = np.array(points)  # (K, 3)
    nearest = ((now[:, None] - stroke.points) ** 2).sum(axis=2).argmin(axis=1)  # (K,)
    radius, intensity = stroke.radius_factors, stroke.intensity_factors
    return replace(
        stroke,
        points=now,
        radius_factors=None if radius is None else radius[nearest],
        intensity_factors=None if intensity is None else intensity[nearest],
    )


def mirror_of(ob: Object) -> frozenset[str]:
    """The axes of the mesh's own symmetry, in object space."""
    mesh = ob.data
    assert isinstance(mesh, Mesh)
    return frozenset(axis for axis in AXES if getattr(mesh, f"use_mirror_{axis.lower()}"))


def radial_settings(context: Context, ob: Object) -> Any:
    """The owner of Blender's own `radial_symmetry`: the mesh, or before 5.0 the scene's settings of
    Sculpt Mode, which are None until that mode was entered once."""
    if hasattr(ob.data, "radial_symmetry"):
        return ob.data
    return context.scene.tool_settings.sculpt


def radial_of(context: Context, ob: Object) -> Counts:
    """How often a stroke is repeated about the axes of object space."""
    settings = radial_settings(context, ob)
    if settings is None:
        return ONCE
    x, y, z = settings.radial_symmetry
    return x, y, z
