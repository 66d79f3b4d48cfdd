# SPDX-License-Identifier: GPL-3.0-or-later
"""What masks and hidden faces protect, frozen with a stroke: so that the history comes to the same
field whatever is masked later.

The mask is that of the proxy under the stroke and its mirror images, on the side of thin parts that
they displace. Some 5 ms for each copy of a stroke near to what is masked, on 100,000 triangles.
Model space.
"""

from dataclasses import replace

import numpy as np
from bpy.types import Object

from ...stroke.displacement import displace
from ...stroke.errors import SculptError
from ...stroke.mask import Mask
from ...stroke.stroke import Stroke
from ..viewport.displaced import Surroundings, reaches, surroundings
from . import brush_attributes, proxy_mesh

FINE = 1 / 8  # radii: spacing of a mask; where the proxy is coarser, the length of its edges


def protected(ob: Object, strokes: tuple[Stroke, ...]) -> tuple[Stroke, ...]:
    """The strokes with what is masked and hidden on the object's proxy now; those that have a mask
    keep it. SculptError when one of them would change nothing."""
    mesh = proxy_mesh.mesh_of(ob)
    if len(mesh.loops) != 3 * len(mesh.polygons):
        return strokes
    triangles = proxy_mesh.corners_of(mesh)
    protection = brush_attributes.protection(mesh, triangles)
    if protection is None:
        return strokes
    positions = proxy_mesh.positions(ob)
    some = positions[protection > 0]

    def one(stroke: Stroke) -> Stroke:
        if stroke.mask is not None or not reaches(stroke, some):
            return stroke
        around = [(copy, surroundings(copy, positions, triangles)) for copy in stroke.copies()]
        mask = _frozen([(copy, a) for copy, a in around if a is not None], protection)
        return replace(stroke, mask=mask)

    return tuple(map(one, strokes))


def _frozen(around: list[tuple[Stroke, Surroundings]], protection: np.ndarray) -> Mask | None:
    """The mask under the copies of a stroke; None when nothing that they reach has one."""
    points, masks, beneath = [], [], []
    for copy, (within, positions, _, near, upright, path) in around:
        nearness = displace(copy, path, positions[near], upright).nearness
        here = np.isfinite(nearness)
        points.append(positions[near][here])
        masks.append(protection[within][here])
        beneath.append(nearness[here] < 1)
    mask, under = np.concatenate(masks), np.concatenate(beneath)
    if not mask.any():
        return None
    if under.any() and (mask[under] == 1).all():
        raise SculptError(
            "All that the stroke would change is masked or hidden. Clear the mask, or draw"
            " elsewhere."
        )
    stroke = around[0][0]
    edges = [a.positions[a.corners[:, 0]] - a.positions[a.corners[:, 1]] for _, a in around]
    edge = float(np.linalg.norm(np.concatenate(edges), axis=1).mean())
    radius = stroke.brush.radius * stroke.largest_factor
    return Mask.of(np.concatenate(points), mask, max(edge, FINE * radius))
