# SPDX-License-Identifier: GPL-3.0-or-later
"""What the .blend stores of the brush of the next stroke, reached through `brush_of(context)`.

Lengths are in model space; `scene_radius` and `scene_intensity` show them in scene units.
"""

from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    PointerProperty,
    StringProperty,
)
from bpy.types import Context, NodeTree, PropertyGroup

from ....stroke.modulation import Modulation
from ....stroke.profile import Profile
from ....stroke.stroke import Direction, Ends, Kind
from ...locale.translations import OURS
from ...presets import alpha_choices, curve_store
from ...presets.shape_choices import CURVE, choice_property, chosen_preset
from ..properties import GROUP, is_field, world_scale

BRUSH = ".neural_sculpt"
"""Name of the data-block with the brush; a leading dot hides it from menus."""


def _choose(brush: "NEURAL_SCULPT_PG_brush", context: Context) -> None:
    """Load a preset that was chosen."""
    curve_store.ensure_curves()
    for shape in (Profile, Modulation):
        choice = getattr(brush, shape.WORD)
        if (preset := chosen_preset(shape, choice)) is not None:
            curve_store.set_curve(preset.kind, preset.points, preset.handles)
            setattr(brush, shape.WORD, CURVE)


def _scene_units(length: str) -> dict[str, Any]:
    """Getter and setter of a model-space length, measured in the active object's scene units."""

    def scale() -> float:
        ob = bpy.context.active_object
        return world_scale(ob) if is_field(ob) else 1.0

    def get(owner: Any) -> float:
        return getattr(owner, length) * scale()

    def put(owner: Any, value: float) -> None:
        setattr(owner, length, value / scale())

    return {"get": get, "set": put, "subtype": "DISTANCE", "precision": 3}


def radius_property() -> Any:
    """Half width of a stroke."""
    return FloatProperty(
        name="Radius",
        description="Half width of the stroke, in model space",
        default=0.1,
        min=0.001,
        soft_max=0.5,
        max=1.0,
    )


def intensity_property() -> Any:
    """Height of a stroke."""
    return FloatProperty(
        name="Intensity",
        description="Height of the stroke, in model space; negative carves",
        default=0.05,
        min=-1.0,
        soft_min=-0.2,
        soft_max=0.2,
        max=1.0,
        translation_context=OURS,
    )


def scene_radius_property() -> Any:
    """The `radius` beside it, in scene units."""
    return FloatProperty(
        name="Radius",
        description="Half width of the stroke, on the active field",
        **_scene_units("radius"),
    )


def scene_intensity_property() -> Any:
    """The `intensity` beside it, in scene units."""
    return FloatProperty(
        name="Intensity",
        description="Height of the stroke, on the active field; negative carves",
        translation_context=OURS,
        **_scene_units("intensity"),
    )


def kind_property() -> Any:
    """Name of a `stroke.Kind`."""
    return EnumProperty(
        name="Kind",
        description="What the stroke does to the surface",
        items=[
            (Kind.DRAW.name, "Draw", "Raise or carve by the intensity", "BRUSH_DATA", 0),
            (
                Kind.SMOOTH.name,
                "Smooth",
                "Take away what is finer than the stroke",
                "MOD_SMOOTH",
                1,
            ),
            (Kind.FLATTEN.name, "Flatten", "Bring the surface to a plane", "MESH_PLANE", 2),
            (Kind.PINCH.name, "Pinch", "Draw the surface together", "MOD_CAST", 3),
        ],
        default=Kind.DRAW.name,
        translation_context=OURS,
    )


def strength_of_kind_property(least: float = 0.0) -> Any:
    """Strength of a stroke that smooths, flattens or pinches: the share of the way to its goal that
    each vertex is moved."""
    return FloatProperty(
        name="Strength",
        description="How far smoothing, flattening and pinching go",
        default=0.5,
        min=least,
        max=1.0,
        subtype="FACTOR",
        translation_context=OURS,
    )


def ends_property() -> Any:
    """Name of a `stroke.Ends`."""
    return EnumProperty(
        name="Ends",
        description="What a stroke does beyond its first and last point",
        items=[
            (Ends.ROUND.name, "Round", "The profile goes around the ends"),
            (Ends.FLAT.name, "Flat", "The stroke is cut off at its ends"),
        ],
        default=Ends.ROUND.name,
        translation_context=OURS,
    )


def direction_property() -> Any:
    """Name of a `stroke.Direction`."""
    return EnumProperty(
        name="Direction",
        description="Along which normal the surface is displaced",
        items=[
            (Direction.SURFACE.name, "Surface", "Each point along its own normal"),
            (
                Direction.STROKE.name,
                "Stroke",
                "All points of a cross-section along the normal in its middle",
            ),
        ],
        default=Direction.SURFACE.name,
        translation_context=OURS,
    )


class NEURAL_SCULPT_PG_brush(PropertyGroup):
    """The brush of the next stroke; lengths are stored in model space.

    strength: of smoothing and of all kinds but Draw, which has an intensity
    """

    kind: kind_property()
    strength: strength_of_kind_property()
    radius: radius_property()
    intensity: intensity_property()
    scene_radius: scene_radius_property()
    scene_intensity: scene_intensity_property()
    profile: choice_property(Profile, "Cross-section of the stroke", "quintic", _choose)
    modulation: choice_property(Modulation, "Strength along the stroke", "identity", _choose)
    alpha: alpha_choices.alpha_property()
    alpha_pixels: StringProperty(
        name="Image", description="Of the alpha, as in a stroke file", options={"HIDDEN"}
    )
    alpha_angle: alpha_choices.angle_property()
    alpha_spacing: alpha_choices.spacing_property()
    curves: PointerProperty(
        type=NodeTree, description="In older files: float curve nodes", options={"HIDDEN"}
    )
    input: EnumProperty(
        name="Input",
        description="How a stroke is drawn",
        items=[
            ("FREEHAND", "Freehand", "Hold the left mouse button and draw"),
            ("POINTS", "Points", "Click control points and confirm with Enter"),
        ],
        default="FREEHAND",
    )
    spacing: FloatProperty(
        name="Spacing",
        description="Distance between the control points of a freehand stroke, in radii",
        default=0.25,
        min=0.05,
        max=2.0,
        subtype="FACTOR",
    )
    stabilizer: FloatProperty(
        name="Stabilizer",
        description="How far the stroke lags behind the pen to smooth it, in radii; 0 follows it",
        default=0.0,
        min=0.0,
        max=2.0,
        subtype="FACTOR",
    )
    adjust: BoolProperty(
        name="Adjust",
        description="A freehand stroke, too, can be edited until Enter confirms it",
    )
    pressure_radius: BoolProperty(
        name="Pressure on Radius",
        description="The pen's pressure changes the radius, by the curve",
    )
    pressure_intensity: BoolProperty(
        name="Pressure on Intensity",
        description="The pen's pressure changes the intensity, by the curve",
        default=True,
    )
    ends: ends_property()
    direction: direction_property()


class NEURAL_SCULPT_PG_point(PropertyGroup):
    """A control point of a stroke, as a property of the stroke operator."""

    location: FloatVectorProperty(
        name="Location", description="Point in model space, the object's local space", size=3
    )
    radius_factor: FloatProperty(
        name="Radius Factor",
        description="Of the brush's radius, at this point",
        default=1.0,
        min=0.0,
        max=10.0,
    )
    intensity_factor: FloatProperty(
        name="Intensity Factor",
        description="Of the brush's intensity, at this point",
        default=1.0,
        min=0.0,
        max=10.0,
    )


def brush_of(context: Context) -> NEURAL_SCULPT_PG_brush:
    """The brush of the next stroke: that of its data-block, or of the scene until `kept_brush` has
    made the data-block."""
    return getattr(curve_store.data_block(BRUSH) or context.scene, GROUP)
