# SPDX-License-Identifier: GPL-3.0-or-later
"""What the .blend stores: a neural field on the object, the brush of the next stroke on a brush.

The groups are reached through `field_of(object)` and `brush_of(context)`. The field lives in model
space, which is the object's local space: world = object.matrix_world @ model.
"""

# pyright: reportInvalidTypeForm=false, reportOptionalMemberAccess=false

from typing import Any, TypeGuard

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from bpy.types import Context, NodeTree, Object, PropertyGroup

from ...stroke.modulation import Modulation
from ...stroke.profile import Profile
from ...stroke.stroke import Direction, Ends, Kind
from ..locale.translations import OURS
from ..presets import alpha_choices, curve_store
from ..presets.shape_choices import CURVE, choice_property, chosen_preset
from . import chosen

GROUP = "neural_sculpt"
"""Name of all groups: Object.neural_sculpt, Brush.neural_sculpt, and Scene.neural_sculpt, where the
brush is in older files."""

BRUSH = ".neural_sculpt"
"""Name of the data-block with the brush; a leading dot hides it from menus."""

DEFAULT_RESOLUTION = 128

REFINED, MOST_TRIANGLES = False, 300_000
"""Whether a new proxy is refined, and to how many triangles at most."""

LOCAL, NETWORK = "LOCAL", "NETWORK"
"""Solvers of the field room, in capitals: strokes add detail, or change the network."""


def resolution_property(description: str, default: int = DEFAULT_RESOLUTION) -> Any:
    """A property that says how fine a proxy is."""
    return IntProperty(
        name="Resolution",
        description=description,
        default=default,
        min=16,
        soft_max=256,
        max=512,
    )


def refine_property() -> Any:
    """Whether a proxy is finer where the field is."""
    return BoolProperty(
        name="Refine",
        description="Split the triangles of the proxy where they are off the surface, so that"
        " strokes finer than the resolution are seen",
        default=REFINED,
    )


def most_triangles_property() -> Any:
    """What a refined proxy may have."""
    return IntProperty(
        name="Most Triangles",
        description="What a refined proxy has at most, but for those that the resolution makes:"
        " where strokes need more, all of them are shown more coarsely",
        default=MOST_TRIANGLES,
        min=10_000,
        soft_max=1_000_000,
        max=5_000_000,
    )


def shown_as(group: "NEURAL_SCULPT_PG_field") -> dict[str, Any]:
    """What a job is told of the proxy that it makes of a field."""
    most = group.most_triangles if group.refine else 0
    return {"resolution": group.resolution, "triangles": most}


def refinement() -> dict[str, int]:
    """What a job is told of the refinement of a new proxy."""
    return {"triangles": MOST_TRIANGLES if REFINED else 0}


def smooth_property() -> Any:
    """Whether a proxy is shaded as the field itself is."""
    return BoolProperty(
        name="Smooth",
        description="Shade the proxy by the normals of the field; otherwise triangles are seen",
        default=True,
    )


def strength_property(**given: Any) -> Any:
    """How much of a layer the field has."""
    return FloatProperty(
        name="Strength",
        description="How much of the stroke is in the field",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        translation_context=OURS,
        **given,
    )


def solver_property() -> Any:
    """Name of a solver of the field room."""
    return EnumProperty(
        name="Sculpt",
        description="What strokes change",
        items=[
            (LOCAL, "Detail", "Each stroke adds detail of its own and leaves all else as it is"),
            (
                NETWORK,
                "Network",
                "Strokes change the weights of the network: a small field, for tools that read"
                " .pth files. Slower and less exact",
            ),
        ],
        default=LOCAL,
        translation_context=OURS,
    )


class NEURAL_SCULPT_PG_listed_stroke(PropertyGroup):
    """An entry of a field's history; read and written by `stroke_list`.

    data:     the stroke as in a stroke file; empty for sculpting that was absorbed
    layer:    what the entry adds to the field, as the worker gave it; `layer_id` names these bytes
    context:  names the base and the layers beneath for which the layer was computed
    """

    name: StringProperty(name="Name", description="Of the stroke; double-click to rename it")
    muted: BoolProperty(name="Muted", description="The stroke is left out of the field")
    strength: strength_property()
    uid: StringProperty(name="Identity", options={"HIDDEN"})
    data: StringProperty(name="Stroke", description="As in a stroke file", options={"HIDDEN"})
    layer: StringProperty(name="Layer", subtype="BYTE_STRING", options={"HIDDEN"})
    layer_id: StringProperty(name="Layer Identity", options={"HIDDEN"})
    context: StringProperty(name="Context", options={"HIDDEN"})


class NEURAL_SCULPT_PG_field(PropertyGroup):
    """A neural field. An object without a revision is an ordinary object.

    The field is its base, a safetensors file, and the layers of all strokes that are not muted,
    each times its strength. Where there are `weights` these are the field as a whole: strokes
    changed the network, or the file is older than layers. `base_id` and `weights_id` name the
    bytes; they are empty in older files.

    BYTE_STRING properties keep every byte through overwriting, undo, save and append; raw bytes as
    ID properties do not.
    """

    base_weights: StringProperty(name="Base Weights", subtype="BYTE_STRING", options={"HIDDEN"})
    base_id: StringProperty(name="Base Identity", options={"HIDDEN"})
    weights: StringProperty(name="Weights", subtype="BYTE_STRING", options={"HIDDEN"})
    weights_id: StringProperty(name="Weights Identity", options={"HIDDEN"})
    solver: solver_property()
    strokes: CollectionProperty(
        type=NEURAL_SCULPT_PG_listed_stroke,
        name="Strokes",
        description="All strokes since the base",
    )
    active_stroke: IntProperty(
        name="Active Stroke", default=-1, options={"HIDDEN"}, update=chosen.choose
    )
    revision: StringProperty(
        name="Revision", description="Names this state of the field", options={"HIDDEN"}
    )
    source: StringProperty(name="Source", description="What the field was made from")
    report: StringProperty(
        name="Report",
        description="Quality of the last fit or stroke, as JSON; empty while it is not known",
        options={"HIDDEN"},
    )
    resolution: resolution_property(
        "Cells along an edge of the field's box in which the proxy is meshed"
    )
    refine: refine_property()
    most_triangles: most_triangles_property()
    smooth: smooth_property()
    live: BoolProperty(
        name="Live Absorption",
        description="In Sculpt Mode, what Blender's own brushes do to the proxy goes into the field"
        " by itself, as an entry of the history",
        default=True,
    )


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
    """The share of its way that a stroke goes that smooths, flattens or pinches."""
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


def field_of(ob: Object) -> NEURAL_SCULPT_PG_field:
    """The object's neural field, empty when it has none."""
    return getattr(ob, GROUP)


def brush_of(context: Context) -> NEURAL_SCULPT_PG_brush:
    """The brush of the next stroke; until `kept_brush` has made it, what is in the scene."""
    return getattr(curve_store.data_block(BRUSH) or context.scene, GROUP)


def is_field(ob: Object | None) -> TypeGuard[Object]:
    """Whether the object is a neural field."""
    return ob is not None and ob.type == "MESH" and bool(field_of(ob).revision)


def world_scale(ob: Object) -> float:
    """Length in the scene of one unit of model space, the mean of the three axes."""
    return sum(abs(axis) for axis in ob.matrix_world.to_scale()) / 3 or 1.0
