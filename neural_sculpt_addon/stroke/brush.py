# SPDX-License-Identifier: GPL-3.0-or-later
"""The brush: how wide, how strong and of which shape a stroke displaces the surface."""

from dataclasses import dataclass, field, replace

from ..common.errors import SculptError
from .alpha import Alpha
from .modulation import Modulation
from .profile import Profile

LEAST_RADIUS = 9.9e-4  # the least that Blender offers is 1e-3, as a float32
LARGEST_RADIUS = 1.0
LARGEST_INTENSITY = 1.0


@dataclass(frozen=True)
class Brush:
    """Brush settings, frozen at the time a stroke was drawn.

    radius:    half width of the tube, model space, in [0.001, 1]
    intensity: signed height of the displacement, model space, in [-1, 1]; negative carves
    alpha:     relief of the displacement, if it has one
    """

    radius: float
    intensity: float
    profile: Profile = field(default_factory=lambda: Profile("quintic"))
    modulation: Modulation = field(default_factory=lambda: Modulation("identity"))
    alpha: Alpha | None = None

    def __post_init__(self) -> None:
        """Refuse sizes that fit no field. SculptError."""
        if not LEAST_RADIUS <= self.radius <= LARGEST_RADIUS:
            raise SculptError(
                "The radius is {}; it must lie between 0.001 and 1.", f"{self.radius:.6g}"
            )
        if not abs(self.intensity) <= LARGEST_INTENSITY:
            raise SculptError(
                "The intensity is {}; it must lie between -1 and 1.", f"{self.intensity:.6g}"
            )

    def mirrored(self) -> "Brush":
        """The brush of a mirror image: a reflection swaps the sides of n x u."""
        alpha = None if self.alpha is None else self.alpha.mirrored()
        return replace(self, profile=self.profile.mirrored(), alpha=alpha)
