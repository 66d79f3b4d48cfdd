# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the curve widgets as files to share: a name, points and the handles between them.

    {"version": 1, "kind": "profile", "name": "Ridge",
     "points": [[-1, 0], [0, 1], [1, 0]], "handles": ["AUTO_CLAMPED", "VECTOR", "AUTO_CLAMPED"]}

Profile: [-1, 1] x [-1, 1]. Modulation: [0, 1] x [0, 1]. A file may come from anybody and is read
strictly. The presets that come with the extension are a list of such files. No bpy here.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..common import reading
from ..common.errors import SculptError
from ..common.text import Text
from ..stroke.modulation import Modulation
from ..stroke.profile import Profile

VERSION = 1
SMOOTH_HANDLE, CORNER_HANDLE = "AUTO_CLAMPED", "VECTOR"
HANDLES = frozenset({SMOOTH_HANDLE, CORNER_HANDLE, "AUTO"})
MOST_CURVE_POINTS = 64
LONGEST_NAME = 48
LARGEST_FILE = 1 << 16  # bytes

BOUNDS = {shape.WORD: shape.DOMAIN for shape in (Profile, Modulation)}
"""Of both axes of a curve widget."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Preset:
    """One shape of a curve widget.

    kind:    "profile" or "modulation"
    points:  (x, y) within the bounds of the kind, x increasing
    handles: one of HANDLES for each point
    """

    kind: str
    name: str
    points: tuple[Point, ...]
    handles: tuple[str, ...]

    def __post_init__(self) -> None:
        """Refuse what no curve widget can show. SculptError."""
        if self.kind not in BOUNDS:
            raise SculptError(
                "A preset is a {}, not {}.", " or a ".join(BOUNDS), f"{self.kind!r:.40}"
            )
        if not 0 < len(self.name.strip()) <= LONGEST_NAME or not self.name.isprintable():
            raise SculptError("A preset's name has 1 to {} printable characters.", LONGEST_NAME)
        low, high = BOUNDS[self.kind]
        if not 2 <= len(self.points) <= MOST_CURVE_POINTS:
            raise SculptError("A preset has 2 to {} points.", MOST_CURVE_POINTS)
        if not all(low <= value <= high for point in self.points for value in point):
            raise SculptError(
                "The points of a {} lie between {} and {}.",
                Text(self.kind),
                f"{low:g}",
                f"{high:g}",
            )
        ahead = zip(self.points, self.points[1:], strict=False)
        if any(right[0] - left[0] < 1e-4 for left, right in ahead):
            raise SculptError("The points of a preset must go from left to right.")
        if len(self.handles) != len(self.points) or not set(self.handles) <= HANDLES:
            raise SculptError("A preset has one handle for each point, as Blender names them.")


def dump_preset(preset: Preset) -> str:
    """The text of a preset file."""
    document = {
        "version": VERSION,
        "kind": preset.kind,
        "name": preset.name,
        "points": [list(point) for point in preset.points],
        "handles": list(preset.handles),
    }
    return json.dumps(document, indent=1, allow_nan=False)


def parse_preset(text: str) -> Preset:
    """The preset in a file. SculptError when it is none, or of a newer version."""
    if len(text) > LARGEST_FILE:
        raise SculptError("This file is too large for a preset.")
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SculptError("This is no JSON preset file ({}).", error) from error
    return _read(document)


def _read(document: object) -> Preset:
    """A preset as `dump_preset` has written it. SculptError when it is none."""
    words = {"version", "kind", "name", "points", "handles"}
    if not isinstance(document, Mapping) or set(document) != words:
        raise SculptError("A preset file has {} and nothing else.", ", ".join(sorted(words)))
    if document["version"] != VERSION:
        raise SculptError(
            "This preset has version {}, this add-on reads version {}. Update Neural Sculpt.",
            f"{document['version']!r:.20}",
            VERSION,
        )
    try:
        return Preset(
            reading.text(document["kind"]),
            reading.text(document["name"]),
            tuple((x, y) for x, y in reading.numbers(document["points"]).tolist()),
            tuple(map(reading.text, document["handles"])),
        )
    except reading.UNREADABLE as error:
        raise SculptError("This preset cannot be read ({}).", error) from error


BUILT_IN = tuple(
    map(_read, json.loads(Path(__file__).with_name("built_in_presets.json").read_bytes()))
)
"""The presets that come with the extension, beside the paper's formulas."""
