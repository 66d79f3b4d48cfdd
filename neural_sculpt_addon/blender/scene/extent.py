# SPDX-License-Identifier: GPL-3.0-or-later
"""Extent of an object in the scene. An object without any along an axis is refused, because nothing
can be brought from the scene into its coordinates."""

import numpy as np
from bpy.types import Object

from ...common.errors import SculptError

LENGTHS = 1e-12, 1e12
"""Between these lies the length in the scene of one unit along any axis: single precision, in which
Blender inverts matrices, holds the product of three."""
FLAT = 1e-6
"""The shortest such length as a share of the longest, up to which it counts as zero: a parent that
flattens an object and is turned leaves some 1e-7 by rounding."""


def refuse_flat(ob: Object) -> None:
    """SculptError when an object's place in the scene is not finite or has no extent along an
    axis."""
    matrix = np.array(ob.matrix_world)  # (4, 4)
    if np.isfinite(matrix).all():
        longest, _, shortest = np.linalg.svd(matrix[:3, :3], compute_uv=False)
        least, most = LENGTHS
        if longest < most and shortest > max(least, FLAT * longest):
            return
    raise SculptError(
        "{} has no size along an axis, or its transform is out of range. Give it a size and a"
        " place: Alt S clears the scale, Alt G the location.",
        ob.name,
    )
