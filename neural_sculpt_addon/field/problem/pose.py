# SPDX-License-Identifier: GPL-3.0-or-later
"""Posing a stroke: its copies are placed on the surface, and what guides them is chosen.

Normals that turn within less than the way to go fan out, and cross each other: displaced along
them, a rough surface becomes lace. So a stroke that would fold is guided by the normals of a field
without detail that is fine for it. Model space. See docs/method.md, section 2.
"""

from collections.abc import Sequence

from ...common.errors import SculptError
from ...common.progress import Check, go_on
from ...stroke.brush import LEAST_RADIUS
from ...stroke.stroke import Stroke
from ..field import Field
from ..threads import join
from .fold import crossings
from .placement import PlacedStroke, place_stroke
from .prepare import Preparation
from .problem import Problem, coarse, coarse_level
from .tube import COLUMNS, ROWS, sample_tube

GUIDING = ROWS // 4, COLUMNS // 4
"""Of the tube that tells whether it folds."""


def pose(preparation: Preparation, stroke: Stroke, check: Check = go_on) -> Problem:
    """The problem that `stroke` poses.

    check: called between pieces of all the work on it, some ten ms each; may raise

    SculptError when it does not lie on the surface or has no width.
    """
    if not stroke.largest_factor:
        raise SculptError("The stroke has no width: its pressure is zero. Draw it again.")
    if (radius := stroke.largest_radius) < LEAST_RADIUS:
        raise SculptError(
            "With its pressure the stroke has a radius of {}; the least is 0.001. Use a"
            " larger radius, or press harder.",
            f"{radius:.2g}",
        )
    placed = []
    for copy in stroke.copies():
        check()
        placed.append(PlacedStroke(copy, place_stroke(preparation.field, copy, preparation.mesh)))
    guide = _guide(preparation.field, placed, check)
    return Problem(preparation, tuple(placed), guide, stroke.seed, check)


def _guide(field: Field, placed: Sequence[PlacedStroke], check: Check) -> Field:
    """Whose normals the surface is displaced along: the field's, or, where it has fine detail and
    the displaced surface would run through itself then, those without that.

    Detail elsewhere tells nothing: a layer depends on those alone that it touches.
    """
    other = coarse(field, placed[0].stroke)
    if other.detail.levels == field.detail.levels:
        return field
    tubes = [sample_tube(field, *one, *GUIDING, check=check) for one in placed]
    before, after = join([(tube.surface, tube.target) for tube in tubes])
    is_fine = field.detail.finest_at(before.points) > coarse_level(placed[0].stroke)
    if not is_fine.any() or not crossings(field, before, after, check).any():
        return field
    return other
