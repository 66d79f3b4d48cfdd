# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of supports in docs/method.md.

A cut across a stroke on two levels: the surface before and after it, the cells that have a node,
the support of one node, and the region in which the field changes. Cells are chosen as by
`field/solve/local.py`, in two dimensions instead of three. Lengths are in cells of the coarse
level. Standard library only; writes docs/supports.svg.
"""

import math
from collections.abc import Iterable, Iterator
from itertools import product

from workshop import ROOT

TARGET = ROOT / "docs" / "supports.svg"
MARGIN, STRIDE = 0.75, 0.7  # as in field/solve/local.py, cells
WIDTH, HEIGHT = 11, 7  # of what is shown, coarse cells
RADIUS, INTENSITY = 2.6, 1.9  # of the stroke, likewise
MIDDLE = WIDTH / 2
SCALE = 44  # pixels of a coarse cell
GAP, TOP, BOTTOM = 36, 40, 96  # pixels
COLOURS = {"active": "#dbe9f8", "reached": "#f4f7fb", "grid": "#c9d3de", "node": "#27609d"}

Point = tuple[float, float]
Cell = tuple[int, int]


def write() -> None:
    """Write the picture."""
    fine_passed = _passed(0.5)
    coarse = {_cell(_centre(cell, 0.5), 1.0) for cell in fine_passed}
    width, height = 2 * WIDTH * SCALE + GAP, HEIGHT * SCALE
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg"'
        f' viewBox="0 0 {width + 40} {height + TOP + BOTTOM}"'
        ' font-family="sans-serif" font-size="15" fill="#222">',
        '<rect width="100%" height="100%" fill="#ffffff"/>',
        *_panel(20, "level k - 1, cells of edge 2 h", coarse, 1.0, (4, 3)),
        *_panel(20 + width - WIDTH * SCALE, "level k, cells of edge h", _dilated(fine_passed), 0.5),
        *_legend(20, TOP + height + 24),
        "</svg>",
    ]
    TARGET.write_text("\n".join(parts) + "\n", encoding="utf-8")


def _surface(x: float) -> float:
    return 2.3 + 0.35 * math.sin(0.5 * x)


def _displaced(x: float) -> Point:
    """Where the stroke moves the surface at x, along its normal, by the quintic profile."""
    slope = 0.175 * math.cos(0.5 * x)
    long = math.hypot(1, slope)
    v = min(abs(x - MIDDLE) / RADIUS, 1)
    amount = INTENSITY * (1 - v**3 * (10 - 15 * v + 6 * v**2))
    return x - amount * slope / long, _surface(x) + amount / long


def _tube() -> Iterator[tuple[Point, Point]]:
    """Surface samples under the stroke, and their targets."""
    for step in range(201):
        x = MIDDLE + RADIUS * (step / 100 - 1)
        yield (x, _surface(x)), _displaced(x)


def _passed(edge: float) -> set[Cell]:
    """The cells that the surface passes on its way, and those within the margin of it."""
    cells = set()
    for before, after in _tube():
        steps = math.ceil(math.dist(before, after) / (STRIDE * edge)) + 1
        for part in range(steps + 1):
            share = part / steps
            between = (a + share * (b - a) for a, b in zip(before, after, strict=True))
            cells.add(_cell(between, edge))
        for (x, y), side in product((before, after), (-MARGIN, MARGIN)):
            cells.add(_cell((x, y + side * edge), edge))
    return cells


def _dilated(cells: Iterable[Cell]) -> set[Cell]:
    return {(i + x, j + y) for i, j in cells for x, y in product((-1, 0, 1), repeat=2)}


def _cell(point: Iterable[float], edge: float) -> Cell:
    x, y = point
    return math.floor(x / edge), math.floor(y / edge)


def _centre(cell: Cell, edge: float) -> Point:
    return (cell[0] + 0.5) * edge, (cell[1] + 0.5) * edge


def _panel(
    left: float, title: str, active: set[Cell], edge: float, chosen: Cell = (7, 8)
) -> Iterator[str]:
    def at(x: float, y: float) -> str:
        return f"{left + SCALE * x:.1f},{TOP + SCALE * (HEIGHT - y):.1f}"

    def square(cell: Cell, size: int, style: str) -> str:
        x, y = at((cell[0] - size // 2) * edge, (cell[1] + 1 + size // 2) * edge).split(",")
        side = size * edge * SCALE
        return f'<rect x="{x}" y="{y}" width="{side:.1f}" height="{side:.1f}" {style}/>'

    yield f'<text x="{left}" y="{TOP - 14}" font-weight="bold">{title}</text>'
    for cells, name in ((_dilated(active), "reached"), (active, "active")):
        for cell in sorted(cells):
            yield square(cell, 1, f'fill="{COLOURS[name]}" stroke="{COLOURS["grid"]}"')
    for cell in sorted(active):
        x, y = at(*_centre(cell, edge)).split(",")
        yield f'<circle cx="{x}" cy="{y}" r="{2 + 2 * edge}" fill="{COLOURS["node"]}"/>'
    yield square(chosen, 3, 'fill="#e07b39" fill-opacity="0.22" stroke="#e07b39" stroke-width="2"')
    x, y = at(*_centre(chosen, edge)).split(",")
    yield f'<circle cx="{x}" cy="{y}" r="{4 + 2 * edge}" fill="#e07b39"/>'
    across = [WIDTH * step / 200 for step in range(201)]
    before = " ".join(at(x, _surface(x)) for x in across)
    after = " ".join(at(*_displaced(x)) for x in across)
    yield f'<polyline points="{before}" fill="none" stroke="#777" stroke-dasharray="6 5"/>'
    yield f'<polyline points="{after}" fill="none" stroke="#111" stroke-width="2.5"/>'


def _legend(left: float, top: float) -> Iterator[str]:
    texts = (
        ('<line x1="{x}" x2="{e}" y1="{y}" y2="{y}" stroke="#777" stroke-dasharray="6 5"/>',
         "surface before the stroke"),
        ('<line x1="{x}" x2="{e}" y1="{y}" y2="{y}" stroke="#111" stroke-width="2.5"/>',
         "surface that it asks for"),
        (f'<rect x="{{x}}" y="{{t}}" width="26" height="16" fill="{COLOURS["active"]}" '
         f'stroke="{COLOURS["grid"]}"/>'
         f'<circle cx="{{m}}" cy="{{y}}" r="3.5" fill="{COLOURS["node"]}"/>',
         "cell with a node: one coefficient"),
        (f'<rect x="{{x}}" y="{{t}}" width="26" height="16" fill="{COLOURS["reached"]}" '
         f'stroke="{COLOURS["grid"]}"/>',
         "cell without one, reached by splines"),
        ('<rect x="{x}" y="{t}" width="26" height="16" fill="#e07b39" fill-opacity="0.22" '
         'stroke="#e07b39" stroke-width="2"/>',
         "support of one node: 3 cells wide"),
        ('<rect x="{x}" y="{t}" width="26" height="16" fill="#fff" stroke="#999"/>',
         "no spline: the field keeps its bits"),
    )  # fmt: skip
    for number, (sign, text) in enumerate(texts):
        x, y = left + 335 * (number % 3), top + 34 * (number // 3)
        yield sign.format(x=x, e=x + 26, m=x + 13, y=y, t=y - 8)
        yield f'<text x="{x + 34}" y="{y + 5}">{text}</text>'
