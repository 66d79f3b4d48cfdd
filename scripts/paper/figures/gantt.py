# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages over time as an SVG: a bar for each span, a line for each stage. Standard library only."""

from collections.abc import Sequence
from html import escape

from ..measures.stages import Span

WIDTH, LEFT, RIGHT = 900, 230, 90  # pixels, of all of it and of its margins
LINE, TOP, BOTTOM = 24, 44, 34
COLOURS = ("#27609d", "#e07b39", "#4f9a6b", "#9a4f86", "#b3a23a", "#5aa7b8")
TICKS = 5


def gantt(title: str, spans: Sequence[Span]) -> str:
    """The picture of `spans`, which begin with the first one."""
    stages = list(dict.fromkeys(span.stage for span in spans))
    begin, end = min(s.start for s in spans), max(s.end for s in spans)
    scale = (WIDTH - LEFT - RIGHT) / max(end - begin, 1e-9)
    height = TOP + LINE * len(stages) + BOTTOM
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}"'
        ' font-family="sans-serif" font-size="13" fill="#222">',
        '<rect width="100%" height="100%" fill="#ffffff"/>',
        f'<text x="16" y="24" font-weight="bold">{escape(title)}</text>',
    ]
    for tick in range(TICKS + 1):
        seconds = (end - begin) * tick / TICKS
        x, bottom = LEFT + scale * seconds, TOP + LINE * len(stages)
        parts.append(f'<path d="M{x:.1f} {TOP - 6}V{bottom}" stroke="#d8dee6"/>')
        told = f"{1e3 * seconds:.0f} ms"
        parts.append(f'<text x="{x:.1f}" y="{bottom + 18}" text-anchor="middle">{told}</text>')
    for number, stage in enumerate(stages):
        y, mine = TOP + LINE * number, [span for span in spans if span.stage == stage]
        colour = COLOURS[number % len(COLOURS)]
        parts.append(f'<text x="{LEFT - 10}" y="{y + 16}" text-anchor="end">{escape(stage)}</text>')
        for span in mine:
            x, long = LEFT + scale * (span.start - begin), scale * (span.end - span.start)
            parts.append(
                f'<rect x="{x:.1f}" y="{y + 4}" width="{max(long, 1):.1f}" height="{LINE - 8}"'
                f' fill="{colour}"/>'
            )
        total, right = sum(s.end - s.start for s in mine), LEFT + scale * (mine[-1].end - begin)
        parts.append(f'<text x="{right + 6:.1f}" y="{y + 16}">{1e3 * total:.1f}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"
