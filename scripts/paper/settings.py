# SPDX-License-Identifier: GPL-3.0-or-later
"""The two sizes of a run: the paper's own, and one that shows in minutes that all of it works."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

SHAPES = ("sphere", "torus", "bunny", "bust", "pumpkin", "frog", "stanford-bunny")


@dataclass(frozen=True)
class Settings:
    """What a run does.

    shapes:        of table 2
    timed_shapes:  of table 1
    points:        of the strokes of table 1; along: those of table 3
    rounds:        of every time that is taken; the median counts
    edits:         random ones on each shape
    samples:       of a Chamfer distance
    cells:         per axis, of the mesh that the ground truth is made of
    speed, quality: epochs of tables of times, and of all others
    stages:        epochs of which table 4 tells the median
    session:       strokes, one upon another
    intensities:   of the strokes that look for where a method tears, in radii
    peaks:         of the profiles that look for what a method can hold
    pixels:        of one picture of a figure, each way
    """

    shapes: tuple[str, ...] = SHAPES
    timed_shapes: tuple[str, ...] = ("sphere", "bunny")
    points: tuple[int, ...] = (8, 16, 32, 64, 128)
    along: tuple[int, ...] = (8, 16, 32, 64, 128, 512)
    rounds: int = 3
    edits: int = 10
    samples: int = 100_000
    cells: int = 256
    speed: int = 50
    quality: int = 100
    stages: int = 21
    session: int = 100
    intensities: tuple[float, ...] = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
    peaks: tuple[int, ...] = (1, 2, 3, 5, 7)
    pixels: int = 420
    seed: int = 2025

    def without(self, shapes: Sequence[str]) -> "Settings":
        """The same for all other shapes."""
        left = tuple(name for name in self.shapes if name not in shapes)
        timed = tuple(name for name in self.timed_shapes if name not in shapes)
        return replace(self, shapes=left, timed_shapes=timed)

    def to_json(self) -> dict[str, Any]:
        """Plain data, to be compared with that of rows which are there already."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}


FULL = Settings()
QUICK = Settings(
    shapes=("sphere",),
    timed_shapes=("sphere",),
    points=(8,),
    along=(8,),
    rounds=1,
    edits=1,
    samples=5_000,
    cells=128,
    speed=2,
    quality=4,
    stages=3,
    session=3,
    intensities=(2.0,),
    peaks=(1, 3),
    pixels=120,
)
