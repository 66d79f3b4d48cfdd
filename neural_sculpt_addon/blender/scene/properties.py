# SPDX-License-Identifier: GPL-3.0-or-later
"""What the .blend stores of a neural field, on its object, reached through `field_of(object)`.

The field lives in model space, which is the object's local space: world = object.matrix_world @
model. The brush is in `brush_properties`.
"""

from typing import Any, TypeGuard

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    StringProperty,
)
from bpy.types import Object, PropertyGroup

from ..locale.translations import OURS
from . import chosen
from .proxy_properties import (
    ShownAs,
    most_triangles_property,
    refine_property,
    resolution_property,
    smooth_property,
)

GROUP = "neural_sculpt"
"""Name of all groups: Object.neural_sculpt, Brush.neural_sculpt, and Scene.neural_sculpt, where the
brush is in older files."""

LOCAL, NETWORK = "LOCAL", "NETWORK"
"""Solvers of the field room, in capitals: strokes add detail, or change the network."""


def shown_as(group: "NEURAL_SCULPT_PG_field") -> dict[str, Any]:
    """What a job is told of the proxy that it makes of a field."""
    shown = ShownAs(group.resolution, group.refine, group.most_triangles, group.smooth)
    return shown.asked()


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
    times_sculpted: IntProperty(
        name="Times Sculpted", description="See `sculpt_mode`", options={"HIDDEN"}
    )
    live: BoolProperty(
        name="Live Absorption",
        description="In Sculpt Mode, what Blender's own brushes do to the proxy goes into the field"
        " by itself, as an entry of the history",
        default=True,
    )


def find(target: int) -> Object | None:
    """The object with this session_uid, which survives undo, as no reference does; None when it is
    gone."""
    return next((ob for ob in bpy.data.objects if ob.session_uid == target), None)


def found(target: int) -> Object:
    """The object of a job whose turn it is; the session has made sure that it is there."""
    ob = find(target)
    assert ob is not None
    return ob


def field_of(ob: Object) -> NEURAL_SCULPT_PG_field:
    """The object's neural field, empty when it has none."""
    return getattr(ob, GROUP)


def is_field(ob: Object | None) -> TypeGuard[Object]:
    """Whether the object is a neural field."""
    return ob is not None and ob.type == "MESH" and bool(field_of(ob).revision)


def world_scale(ob: Object) -> float:
    """Length in the scene of one unit of model space, the mean of the three axes."""
    return sum(abs(axis) for axis in ob.matrix_world.to_scale()) / 3 or 1.0
