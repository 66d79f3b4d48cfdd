# SPDX-License-Identifier: GPL-3.0-or-later
"""Lost parts of an absorbed surface: what the field could not hold, its share and its places.

These are details finer than the finest level, and folds whose sheets lie nearer to each other than
cells are wide. Model space.
"""

from typing import Any

from numpy.typing import NDArray

from ...common.text import Text
from ..fit.fit_report import worst

LOST = 3e-4
"""Distance, model units, from which on an artist sees that a place is off."""

UNTOLD = 0.03
"""Share of what was moved that may be lost without a word. Usual dabs and creases lose up to 0.02,
what folds over or is as rough as its triangles 0.07 and more."""


def lost(points: NDArray, error: NDArray) -> dict[str, Any]:
    """Of a report, ready for JSON: the share of `points` (N, 3) whose `error` (N,) is seen and,
    where that is more than UNTOLD, the `worst` places and a sentence."""
    share = float((error > LOST).mean()) if len(error) else 0.0
    found: dict[str, Any] = {"lost_share": share}
    if share > UNTOLD:
        found["worst"] = worst(points, error, LOST)
        found["notes"] = [
            Text(
                "The field lacks {} of what was moved: it folds over itself, or is finer than the"
                " finest level.",
                f"{share:.0%}",
            )
        ]
    return found
