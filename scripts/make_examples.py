# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the stroke files of examples/: python3 scripts/make_examples.py.

Each is sculpted on one of the ready fields, so anyone can replay it:

    python -m neural_sculpt_addon apply neural_sculpt_addon/primitives/torus.safetensors \\
        examples/ring.json -o ring.safetensors --mesh ring.ply

Strokes are drawn as curves near the surface and brought onto it. Model space.
"""

import argparse
import json
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from workshop import ROOT, environment

FOLDER = ROOT / "examples"
DIGITS = 4
STEPS, LONGEST = 200, 0.05  # of points on their way to the surface from the front
CARVED = {"points": [[-1, 0], [-0.6, 0.15], [0, -1], [0.6, 0.15], [1, 0]]}
CHISEL = {"points": [[-1, 0], [-0.35, -1], [0.15, 0.35], [1, 0]]}  # not symmetric
WAVES = {"points": [[-1, 0], [-0.75, 1], [-0.25, -1], [0.25, 1], [0.75, -1], [1, 0]]}
BRAID = {"points": [[-1, 0], [-0.5, 1], [0, 0.1], [0.5, 1], [1, 0]]}

Point = tuple[float, float, float]
Data = dict[str, Any]


class Example(NamedTuple):
    """A stroke file: the field that it is for, and what draws it.

    from_front: points lie before the shape, and are brought onto it along y
    """

    field: str
    strokes: Callable[[], list[Data]]
    from_front: bool = False


def on_sphere(longitude: float, latitude: float) -> Point:
    """A point of the sphere of radius 0.6; degrees, longitude 0 in front (-y), 90 at the right."""
    a, b = math.radians(longitude), math.radians(latitude)
    return (
        0.6 * math.sin(a) * math.cos(b),
        -0.6 * math.cos(a) * math.cos(b),
        0.6 * math.sin(b),
    )


def on_torus(around: float, over: float) -> Point:
    """A point of the torus of radii 0.5 and 0.2 around z; degrees, `over` 0 outside, 90 on top."""
    a, b = math.radians(around), math.radians(over)
    far = 0.5 + 0.2 * math.cos(b)
    return far * math.cos(a), far * math.sin(a), 0.2 * math.sin(b)


def stroke(
    name: str, points: Sequence[Point], radius: float, intensity: float, **more: Any
) -> Data:
    """The data of a stroke."""
    return {"name": name, "points": points, "radius": radius, "intensity": intensity, **more}


def ring() -> list[Data]:
    """A band with a braid around it, a setting, and a gem."""
    band = [on_torus(a, 90) for a in range(0, 360, 10)]
    twist = [on_torus(a, 90 + 55 * math.sin(math.radians(6 * a))) for a in range(0, 360, 3)]
    gem = on_torus(270, 0)
    setting = [
        on_torus(270 + 15 * math.cos(t), 38 * math.sin(t))
        for t in (2 * math.pi * k / 24 for k in range(24))
    ]
    return [
        stroke("Groove", band, 0.13, -0.03, closed=True, profile={"name": "quintic"}),
        stroke("Braid", twist, 0.035, 0.03, closed=True, profile=BRAID),
        stroke("Setting", setting, 0.035, 0.03, closed=True),
        stroke("Gem", [gem], 0.11, 0.12, profile={"name": "cubic"}),
    ]


def pumpkin() -> list[Data]:
    """Ribs, a stalk, and a face that is carved into them."""
    rib = [on_sphere(18, b) for b in range(-80, 81, 10)]
    mouth = [on_sphere(a, -11 - 12 * math.cos(math.radians(2.2 * a))) for a in range(-42, 43, 7)]
    carved = {"profile": {"name": "cubic"}}
    return [
        stroke("Ribs", rib, 0.1, -0.06, radial=[1, 1, 10], profile={"name": "cubic"}),
        stroke("Stalk", [on_sphere(0, 90)], 0.13, 0.14, profile={"name": "cubic"}),
        stroke("Eyes", [on_sphere(22, 18)], 0.1, -0.09, mirror="X"),
        stroke("Nose", [on_sphere(0, 3)], 0.06, -0.05, **carved),
        stroke("Mouth", mouth, 0.05, -0.06, **carved),
        stroke("Teeth", [on_sphere(13, -18)], 0.04, 0.05, mirror="X"),
    ]


def scales() -> list[Data]:
    """Rows of scales on the back of a lizard's ring, and a crest of spikes."""
    back = [on_torus(a, 40) for a in range(0, 360, 8)]
    side = [on_torus(a, -5) for a in range(0, 360, 8)]
    crest = [on_torus(a, 90) for a in range(0, 360, 15)]
    alpha = {"alpha": {"name": "scales"}, "profile": {"name": "cubic"}, "closed": True}
    spikes = [
        stroke(f"Spike {n + 1}", [place], 0.05, 0.07, profile={"name": "linear"})
        for n, place in enumerate(crest)
    ]
    return [
        stroke("Scales above", back, 0.13, 0.02, **alpha),
        stroke("Scales beside", side, 0.13, 0.02, **alpha),
        *spikes,
    ]


LETTERS = {  # strokes of capital letters: places from 0 to 1 to the right and up
    "S": [[(0.95, 0.85), (0.5, 1), (0.1, 0.78), (0.5, 0.5), (0.9, 0.25), (0.5, 0), (0.05, 0.15)]],
    "D": [
        [(0.1, 0), (0.1, 0.5), (0.1, 1)],
        [(0.1, 1), (0.7, 0.85), (0.9, 0.5), (0.7, 0.15), (0.1, 0)],
    ],
    "F": [
        [(0.1, 0), (0.1, 0.5), (0.1, 1)],
        [(0.1, 1), (0.5, 1), (0.9, 1)],
        [(0.1, 0.52), (0.4, 0.52), (0.7, 0.52)],
    ],
}


def inscription() -> list[Data]:
    """Letters on a sphere, cut by an asymmetric brush as by a chisel, and a frame."""
    made = []
    for place, letter in enumerate("SDF"):
        for number, line in enumerate(LETTERS[letter], start=1):
            points = [on_sphere(-38 + 28 * place + 20 * x, -15 + 32 * y) for x, y in line]
            made.append(stroke(f"{letter} {number}", points, 0.03, 0.025, profile=CHISEL))
    frame = [
        on_sphere(52 * math.copysign(abs(math.cos(t)) ** 0.5, math.cos(t)),
                  30 * math.copysign(abs(math.sin(t)) ** 0.5, math.sin(t)))
        for t in (2 * math.pi * k / 48 for k in range(48))
    ]  # fmt: skip
    return [stroke("Frame", frame, 0.04, 0.025, closed=True, profile=CARVED), *made]


def robot() -> list[Data]:
    """Suzanne in panels with rivets, seen from the front: (x, z) of the face."""

    def face(x: float, z: float) -> Point:
        return x, -0.9, z

    seam = {"profile": CARVED, "mirror": "X"}
    brow = [face(x, z) for x, z in ((0.02, 0.3), (0.15, 0.36), (0.3, 0.33), (0.4, 0.2))]
    cheek = [face(x, z) for x, z in ((0.24, 0.0), (0.15, -0.22), (0.15, -0.34))]
    middle = [face(0.0, z) for z in (0.55, 0.49, 0.43, 0.37)]
    jaw = [face(x, z) for x, z in ((-0.16, -0.36), (0, -0.37), (0.16, -0.36))]
    rivets = [(0.08, 0.42), (0.18, 0.44), (0.28, 0.42), (0.13, -0.2), (0.1, -0.46)]
    return [
        stroke("Brow seam", brow, 0.03, 0.03, **seam),
        stroke("Cheek seam", cheek, 0.03, 0.03, **seam),
        stroke("Forehead seam", middle, 0.03, 0.03, profile=CARVED),
        stroke("Jaw", jaw, 0.045, -0.04, profile={"name": "quintic"}),
        *(
            stroke(f"Rivet {n}", [face(*place)], 0.025, 0.02, mirror="X", profile={"name": "cubic"})
            for n, place in enumerate(rivets, start=1)
        ),
    ]


def hair() -> list[Data]:
    """Strands over Suzanne's skull, from the parting down both sides, thinner at their ends."""
    made = []
    for row in range(9):
        back = -0.28 + 0.1 * row  # y
        strand = [
            (0.03 + 0.5 * math.sin(t), back + 0.1 * t, 0.12 + 0.62 * math.cos(t))
            for t in (0.1 + 0.14 * k for k in range(7))
        ]
        made.append(
            stroke(
                f"Strand {row + 1}",
                strand,
                *(0.034, 0.034 if row % 2 else 0.024),
                mirror="X",
                profile={"name": "cubic"},
                modulation={"points": [[0, 0.4], [0.3, 1], [0.8, 0.8], [1, 0]]},
                radius_factors=[1, 1, 1, 0.95, 0.9, 0.8, 0.6],
            )
        )
    return made


def idol() -> list[Data]:
    """A head out of a sphere in fourteen strokes, no two of which have the same brush."""

    def way(*places: tuple[float, float]) -> list[Point]:
        return [on_sphere(*place) for place in places]

    sides = {"mirror": "X"}
    rising = {"points": [[0, 0.15], [0.75, 1], [1, 0.9]]}
    return [
        stroke("chin", way((0, -68)), 0.34, 0.13),
        stroke("brows", way((4, 18), (14, 27), (30, 30), (48, 20)), 0.1, 0.08, **sides),
        stroke("sockets", way((21, 8)), 0.15, -0.09, **sides),
        stroke("eyes", way((21, 8)), 0.09, 0.08, profile={"name": "cubic"}, **sides),
        stroke("lids", way((9, 8), (21, 20), (33, 8)), 0.035, 0.025,
               profile={"name": "linear"}, modulation={"name": "central"}, **sides),
        stroke("nose", way((0, 18), (0, 8), (0, -2), (0, -12)), 0.09, 0.14, modulation=rising),
        stroke("mouth", way((-26, -33), (-13, -35), (0, -36), (13, -35), (26, -33)), 0.07, 0.06,
               profile=CARVED, modulation={"points": [[0, 0.3], [0.3, 1], [0.7, 1], [1, 0.3]]}),
        stroke("cheeks", way((10, -10), (22, -14), (33, -28), (32, -42)), 0.06, 0.035,
               modulation={"name": "exponential"}, **sides),
        stroke("forehead", way((-26, 45), (-13, 47), (0, 48), (13, 47), (26, 45)), 0.085, 0.02,
               profile=WAVES),
        stroke("ears", way((88, 4)), 0.2, 0.22, profile={"name": "quintic"}, **sides),
        stroke("hollows", way((72, 4)), 0.09, -0.08, profile={"name": "cubic"}, **sides),
        stroke("hair", way((40, 70), (58, 58), (72, 42), (80, 30)), 0.065, 0.03,
               profile=BRAID, **sides),
        stroke("crest", [*way(*((0, b) for b in range(64, 90, 8))),
                         *way(*((180, b) for b in range(86, 20, -8)))], 0.06, 0.045,
               profile={"name": "cubic"}, modulation={"name": "sinusoidal"}),
        stroke("beard", way((0, -54), (0, -61), (0, -68)), 0.11, 0.1,
               profile={"name": "linear"}, modulation={"name": "linear"}),
    ]  # fmt: skip


EXAMPLES = {
    "ring": Example("torus", ring),
    "pumpkin": Example("sphere", pumpkin),
    "scales": Example("torus", scales),
    "inscription": Example("sphere", inscription),
    "robot": Example("suzanne", robot, from_front=True),
    "hair": Example("suzanne", hair),
    "idol": Example("sphere", idol),
}


def main() -> None:
    """Write all files."""
    argparse.ArgumentParser(description="Write the stroke files of examples/.").parse_args()
    environment.enter("worker")
    FOLDER.mkdir(exist_ok=True)
    for name, example in EXAMPLES.items():
        path = FOLDER / f"{name}.json"
        path.write_text(_file(example), encoding="utf-8")
        print(f"{path.relative_to(ROOT)}, on {example.field}")


def _file(example: Example) -> str:
    """The stroke file, its points on the surface."""
    import numpy as np

    from neural_sculpt_addon.field.evaluate import values
    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.field.projection import project

    field, strokes = primitive(example.field), []
    for data in example.strokes():
        points = np.array(data["points"], np.float32)
        for _ in range(STEPS if example.from_front else 0):
            points[:, 1] += np.clip(values(field, points), 0, LONGEST) / 2
        points = project(field, points, steps=20).points
        strokes.append({**data, "points": np.round(points, DIGITS).tolist()})
    lines = ",\n".join(json.dumps(data) for data in strokes)
    return f'{{"version": 1, "strokes": [\n{lines}\n]}}\n'


if __name__ == "__main__":
    main()
