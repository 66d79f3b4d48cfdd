# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes for the benchmarks of edits, drawn by walking over a surface. Model space."""

from typing import TYPE_CHECKING, Any

from . import scored_cases

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from neural_sculpt_addon.field.field import Field
    from neural_sculpt_addon.field.mesh.surface import Samples
    from neural_sculpt_addon.stroke.stroke import Stroke

PRIMITIVES, PRETRAINED = ("sphere", "torus", "suzanne"), ("bunny", "frog")
POINTS, LENGTH = 24, 0.5  # of a walk
STRAIGHT, LOOP, CROSSING = 0.0, 1.0, 1.4  # turns on the way

RADII, INTENSITIES = (0.02, 0.15), (0.01, 0.08)  # of mixed strokes
LENGTHS, TURNS = (0.1, 0.7), (-0.6, 0.6)
MIRRORED = 1 / 8
PEAKS = [(-1 + k / 7, k % 2) for k in range(15)]
PROFILES: "list[dict[str, Any]]" = [
    {"name": "linear"},
    {"name": "cubic"},
    {"name": "quintic"},
    {"points": [(-1, 0), (-0.5, 1), (0, -0.5), (0.5, 1), (1, 0)]},
    {"points": [(-1, 0), (-0.5, 1), (0, 0), (0.5, 1), (1, 0)]},
    {"points": [(-1, 0), (-0.3, 0.2), (0.4, 1), (1, 0)]},
    {"points": [(-1, 0), (-0.55, 0.45), (0, -1), (0.55, 0.45), (1, 0)]},
    {"points": [(-1, 0), (-0.6, -0.5), (0.5, 1), (1, 0)]},
]
HARD: "dict[str, dict[str, Any]]" = {
    "thin": {"radius": 0.02, "intensity": 0.02},
    "seven": {"profile": {"points": PEAKS}},
    "five": {"profile": {"points": [(-1, 0), (-0.5, 1), (0, -0.5), (0.5, 1), (1, 0)]}},
    "ridges": {"profile": {"points": [(-1, 0), (-0.5, 1), (0, 0), (0.5, 1), (1, 0)]}},
    "sinus": {"modulation": {"name": "sinusoidal"}},
    "crossing": {"turns": CROSSING, "length": 0.9},
    "closed": {"turns": LOOP, "closed": True, "length": 0.9},
    "carved": {"intensity": -0.1},
    "high": {"intensity": 0.15},
}


def fields() -> "Iterator[tuple[str, Field]]":
    """The primitives, and pretrained networks where they are present."""
    from neural_sculpt_addon.field.checkpoint import load
    from neural_sculpt_addon.field.primitives import primitive

    for name in PRIMITIVES:
        yield name, primitive(name)
    for name in PRETRAINED:
        path = scored_cases.CASES.parent.parent / "networks" / f"{name}.pth"
        if path.is_file():
            yield name, load(path)


def hard(field: "Field", surface: "Samples", name: str, seed: int = 1) -> "Stroke":
    """The stroke HARD[name] from a random place of the surface."""
    import numpy as np

    from neural_sculpt_addon.stroke.stroke import Stroke

    brush = {"radius": 0.08, "intensity": 0.06, "turns": STRAIGHT, "length": LENGTH} | HARD[name]
    turns, length = brush.pop("turns"), brush.pop("length")
    points = walk(field, surface, length, turns, POINTS, np.random.default_rng(seed))
    if brush.get("closed"):
        points = points[:-1]
    return Stroke.from_json({"points": points.tolist(), "seed": seed, "name": name, **brush})


def mixed(field: "Field", surface: "Samples", random: "np.random.Generator") -> "Stroke":
    """A stroke as in a session of sculpting: anywhere, of any brush."""
    import numpy as np

    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.modulation import Modulation
    from neural_sculpt_addon.stroke.profile import Profile
    from neural_sculpt_addon.stroke.stroke import Stroke

    points = walk(field, surface, random.uniform(*LENGTHS), random.uniform(*TURNS), POINTS, random)
    brush = Brush(
        float(np.exp(random.uniform(*np.log(RADII)))),
        float(random.choice([-1, 1]) * random.uniform(*INTENSITIES)),
        Profile.from_json(PROFILES[random.integers(len(PROFILES))]),
        Modulation(str(random.choice(sorted(Modulation.FORMULAS)))),
    )
    mirror = frozenset("X" if random.random() < MIRRORED else "")
    return Stroke(points, brush, mirror=mirror, seed=int(random.integers(1 << 31)))


def walk(
    field: "Field",
    surface: "Samples",
    length: float,
    turns: float,
    count: int,
    random: "np.random.Generator",
) -> "NDArray[np.float64]":
    """`count` points (count, 3) on the surface along a way that turns evenly."""
    import numpy as np

    from neural_sculpt_addon.field.projection import project

    start = random.integers(len(surface.points))
    ahead, step, angle = random.normal(size=3), length / (count - 1), 2 * np.pi * turns / count
    place, normal = surface.points[start].astype(float), surface.normals[start].astype(float)
    points = []
    for _ in range(count):
        here = project(field, place[None])
        place, normal = here.points[0].astype(float), here.normals[0].astype(float)
        points.append(place)
        ahead -= ahead @ normal * normal
        ahead /= np.linalg.norm(ahead)
        ahead = np.cos(angle) * ahead + np.sin(angle) * np.cross(normal, ahead)
        place = place + step * ahead
    return np.array(points)
