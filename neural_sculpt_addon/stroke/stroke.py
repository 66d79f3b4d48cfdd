# SPDX-License-Identifier: GPL-3.0-or-later
"""A stroke: control points on the surface and the brush with which they were drawn.

Plain data in model space that round-trips through JSON. Defined cases: one point (or one repeated)
is a dab, a round displacement about it; a closed stroke joins its ends; where a stroke crosses
itself, the nearest pass decides.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..common import reading
from ..common.errors import SculptError
from .alpha import Alpha
from .brush import Brush
from .curve import through
from .mask import Mask
from .modulation import Modulation
from .profile import Profile
from .symmetry import AXES, MOST_TURNS, ONCE, Counts, images

MOST_POINTS = 2048
MOST_COPIES = 128  # solved together: each is laid on the surface and sampled by itself
LEAST_FACTOR = 1e-3  # pressure below it is none
BOX = 1.0  # strokes lie in [-1, 1]^3
SAME = 1e-6  # model units: copies that lie nearer to each other are one

T = TypeVar("T")


class Kind(StrEnum):
    """What a stroke does to the surface.

    DRAW:    displaces it by the intensity, a length
    SMOOTH, FLATTEN, PINCH: bring it a share of the way to what it would be without what is finer
             than the stroke, flat, or drawn together. The share is the intensity; a negative one
             goes the other way
    """

    DRAW = "draw"
    SMOOTH = "smooth"
    FLATTEN = "flatten"
    PINCH = "pinch"


class Ends(StrEnum):
    """What an open stroke does beyond its first and last point."""

    ROUND = "round"
    FLAT = "flat"


class Direction(StrEnum):
    """Along which normal the surface is displaced.

    SURFACE: each surface point along its own normal, so a wide stroke follows the shape.
    STROKE:  all points of a cross-section along the normal n(u) of the stroke (paper, section 3).
    """

    SURFACE = "surface"
    STROKE = "stroke"


@dataclass(frozen=True)
class Stroke:
    """One stroke.

    points:  (K, 3) control points in model space, on the surface
    radius_factors, intensity_factors: (K,) or None, pen pressure at each control point, >= 0
    mirror:  the axes across whose planes (x = 0, ...) the stroke is repeated
    seed:    of all random numbers that its edit draws
    kind:    what it does; the brush's intensity is a length or a share accordingly
    mask:    what it leaves where it is; of the surface under its images, too
    radial:  how often it is repeated about the axes X, Y and Z, see `symmetry`
    image:   (3, 3), of one of the `copies`: where it lies, seen from the stroke that was drawn.
             Not in files
    """

    points: NDArray[np.float64]
    brush: Brush
    closed: bool = False
    radius_factors: NDArray[np.float64] | None = None
    intensity_factors: NDArray[np.float64] | None = None
    ends: Ends = Ends.ROUND
    direction: Direction = Direction.SURFACE
    mirror: frozenset[str] = frozenset()
    name: str = ""
    seed: int = 0
    kind: Kind = Kind.DRAW
    mask: Mask | None = None
    radial: Counts = ONCE
    image: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        """Bring arrays to float64 and refuse what is no stroke. SculptError."""
        points = _numbers(self.points, "points")
        if points.ndim != 2 or points.shape[1] != 3 or not 1 <= len(points) <= MOST_POINTS:
            raise SculptError("A stroke needs 1 to {} points of three coordinates.", MOST_POINTS)
        if np.abs(points).max() > BOX:
            raise SculptError(
                "The stroke leaves the box [-1, 1]^3 of the field; draw on the surface."
            )
        object.__setattr__(self, "points", points)
        for word in ("radius_factors", "intensity_factors"):
            if (factors := getattr(self, word)) is None:
                continue
            factors = _numbers(factors, word)
            if factors.shape != (len(points),) or factors.min() < 0 or factors.max() > 10:
                raise SculptError("A stroke's {} are one number from 0 to 10 for each point.", word)
            factors = np.where(factors < LEAST_FACTOR, 0.0, factors)
            object.__setattr__(self, word, factors)
        if not 0 <= self.seed < 2**63:
            raise SculptError(
                "The stroke's seed is {}; it must be from 0 to 2^63 - 1.", f"{self.seed!s:.100}"
            )
        if not self.mirror <= set(AXES):
            raise SculptError("A stroke is mirrored across X, Y or Z and nothing else.")
        if len(self.radial) != 3 or not all(1 <= count <= MOST_TURNS for count in self.radial):
            raise SculptError(
                "A stroke's radial needs three counts from 1 to {}, for X, Y and Z.", MOST_TURNS
            )
        if (count := len(images(self.mirror, self.radial))) > MOST_COPIES:
            raise SculptError(
                "The stroke would be repeated {} times; at most {} are possible. Mirror it"
                " across fewer axes, or lower its radial counts.",
                count,
                MOST_COPIES,
            )

    def __eq__(self, other: object) -> bool:
        """Equal when all data are equal."""
        return isinstance(other, Stroke) and self.to_json() == other.to_json()

    __hash__ = None  # pyright: ignore[reportAssignmentType] - Python's way to say that it has none

    @property
    def largest_factor(self) -> float:
        """The largest radius factor."""
        return _largest(self.radius_factors)

    @property
    def largest_radius(self) -> float:
        """The radius where the stroke is widest."""
        return self.brush.radius * self.largest_factor

    @property
    def largest_intensity(self) -> float:
        """|intensity| where the stroke is strongest, before profile and modulation."""
        return abs(self.brush.intensity) * _largest(self.intensity_factors)

    @property
    def images(self) -> NDArray[np.float64]:
        """Where the stroke is repeated, as matrices (M, 3, 3); the first is the identity.

        An image that leaves the box, turned about an axis, is left out: no surface is there.
        """
        found = images(self.mirror, self.radial)
        return found[(np.abs(found @ self.points.T) <= BOX).all(axis=(1, 2))]

    @property
    def left_out(self) -> int:
        """How many images leave the box."""
        return len(images(self.mirror, self.radial)) - len(self.images)

    def copies(self) -> tuple["Stroke", ...]:
        """The stroke itself and its images, each without a symmetry of its own.

        A reflection swaps the sides of n x u, so the brush is mirrored with it; a rotation does
        not. Images that lie upon each other, as of a dab on an axis, are one.
        """
        copies: dict[int, Stroke] = {}
        middles = self.images @ self.points.mean(axis=0)  # (M, 3)
        for number, image in enumerate(self.images):
            flipped = np.linalg.det(image) < 0
            copy = replace(
                self,
                points=self.points @ image.T,
                brush=self.brush.mirrored() if flipped else self.brush,
                mirror=frozenset(),
                radial=ONCE,
                image=image,
            )
            near = np.flatnonzero(np.abs(middles - middles[number]).max(axis=1) <= SAME)
            if not any(_coincide(copy, copies[other]) for other in near if other in copies):
                copies[number] = copy
        return tuple(copies.values())

    def to_json(self) -> dict[str, Any]:
        """Plain data for a stroke file; what has its default value is left out."""
        data: dict[str, Any] = {
            "points": self.points.tolist(),
            "radius": self.brush.radius,
            "intensity": self.brush.intensity,
            "profile": self.brush.profile.to_json(),
            "modulation": self.brush.modulation.to_json(),
        }
        if self.brush.alpha is not None:
            data["alpha"] = self.brush.alpha.to_json()
        for word in ("radius_factors", "intensity_factors"):
            if (factors := getattr(self, word)) is not None:
                data[word] = factors.tolist()
        if self.kind is not Kind.DRAW:
            data["kind"] = self.kind.value
        if self.ends is not Ends.ROUND:
            data["ends"] = self.ends.value
        if self.direction is not Direction.SURFACE:
            data["direction"] = self.direction.value
        if self.mirror:
            data["mirror"] = "".join(sorted(self.mirror))
        if self.radial != ONCE:
            data["radial"] = [*self.radial]
        for word in ("closed", "name", "seed"):
            if value := getattr(self, word):
                data[word] = value
        if self.mask is not None:
            data["mask"] = self.mask.to_json()
        return data

    @staticmethod
    def from_json(data: object) -> "Stroke":
        """Read what `to_json` wrote. SculptError when it is something else."""
        if not isinstance(data, Mapping):
            raise SculptError("A stroke is a JSON object with points, radius and intensity.")
        if unknown := set(data) - _WORDS:
            names = ", ".join(sorted(map(str, unknown)))
            raise SculptError("A stroke has no field {}.", f"{names:.100}")
        if missing := {"points", "radius", "intensity"} - set(data):
            raise SculptError("The stroke lacks {}.", ", ".join(sorted(missing)))
        brush = Brush(
            radius=_read(reading.number, data, "radius", 0.0),
            intensity=_read(reading.number, data, "intensity", 0.0),
            profile=Profile.from_json(data.get("profile", {"name": "quintic"})),
            modulation=Modulation.from_json(data.get("modulation", {"name": "identity"})),
            alpha=Alpha.from_json(data["alpha"]) if "alpha" in data else None,
        )
        return Stroke(
            points=data["points"],
            brush=brush,
            closed=_read(reading.flag, data, "closed", False),
            radius_factors=data.get("radius_factors"),
            intensity_factors=data.get("intensity_factors"),
            ends=_read(Ends, data, "ends", Ends.ROUND),
            direction=_read(Direction, data, "direction", Direction.SURFACE),
            mirror=frozenset(_read(reading.text, data, "mirror", "")),
            name=_read(reading.text, data, "name", ""),
            seed=_read(reading.integer, data, "seed", 0),
            kind=_read(Kind, data, "kind", Kind.DRAW),
            mask=Mask.from_json(data["mask"]) if "mask" in data else None,
            radial=_read(_counts, data, "radial", ONCE),
        )


_WORDS = {
    *("points", "radius", "intensity", "profile", "modulation", "alpha", "closed"),
    *("radius_factors", "intensity_factors", "ends", "direction", "mirror", "name", "seed", "kind"),
    *("radial", "mask"),
}


def _read(kind: Callable[[Any], T], data: Mapping[str, Any], word: str, default: T) -> T:
    try:
        return kind(data[word]) if word in data else default
    except reading.UNREADABLE as error:
        raise SculptError("The stroke's {} cannot be {}.", word, f"{data[word]!r:.60}") from error


def _numbers(data: object, word: str) -> NDArray[np.float64]:
    """An array of finite numbers."""
    try:
        array = reading.numbers(data)
    except reading.UNREADABLE as error:
        raise SculptError("The stroke's {} are no numbers.", word) from error
    if not np.isfinite(array).all():
        raise SculptError("The stroke's {} hold NaN or infinite numbers.", word)
    return array


def _counts(data: object) -> Counts:
    """Three integers, for X, Y and Z."""
    if not isinstance(data, list | tuple):
        raise TypeError("no list")
    x, y, z = (reading.integer(count) for count in data)
    return x, y, z


def _largest(factors: NDArray[np.float64] | None) -> float:
    return 1.0 if factors is None else float(factors.max())


def _coincide(one: Stroke, other: Stroke) -> bool:
    """Whether two copies of a stroke displace the surface alike: their points are the same, in the
    same order or, where neither ends nor sides tell, in another one."""
    if one.brush.alpha is not None:
        return False
    mine, theirs = one.brush.profile, other.brush.profile
    if np.ptp(one.points, axis=0).max() <= SAME:  # a dab is turned about itself
        return mine == mine.mirrored()
    modulation = one.brush.modulation(np.linspace(0, 1, 257))
    starts, (_, closed) = [0], through(one.points, one.closed)
    if closed and np.ptp(modulation) == 0:
        starts = np.flatnonzero(np.abs(other.points - one.points[0]).max(axis=1) <= SAME).tolist()
    order, last = np.arange(len(one.points)), 0 if closed else -1
    orders = [(start + order, theirs) for start in starts]
    if np.allclose(modulation, modulation[::-1]):
        orders += [(start + last - order, theirs.mirrored()) for start in starts]
    factors = [f for f in (one.radius_factors, one.intensity_factors) if f is not None]
    return any(
        mine == profile
        and np.abs(one.points - other.points.take(places, axis=0, mode="wrap")).max() <= SAME
        and all(np.array_equal(f, f.take(places, mode="wrap")) for f in factors)
        for places, profile in orders
    )
