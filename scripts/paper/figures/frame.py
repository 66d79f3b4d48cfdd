# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame u, v, n and the tube of a stroke, drawn on the surface before and after it.

Left: the path with frames at three of its points, and the grid of tube samples p. Right: the same
samples where the stroke takes them, p' = p + m(u) s b(v / r) n, on the field that ours made of it.
"""

from pathlib import Path

import numpy as np
from pictures import rendered, sheet
from pictures.field_picture import Camera, trace
from pictures.sheet import LARGER, Picture
from PIL import Image, ImageDraw

from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.problem.tube import Tube, sample_tube
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.path import Path as StrokePath
from neural_sculpt_addon.stroke.stroke import Stroke

from ..measures.surface import Array
from ..settings import Settings
from ..work import Row, Task
from .strokes import read

SHAPE, RADIUS, INTENSITY = "sphere", 0.14, 0.1
CAMERA = Camera((0.15, -0.75, 0.95), target=(0.04, -0.46, 0.24), half=0.53)
ROWS, COLUMNS = 29, 9  # of the grid that is shown; 99 x 101 are computed
FRAMES = (0.16, 0.5, 0.84)  # u of the frames
LENGTH = 0.16  # of an axis
HIDDEN = 0.01  # behind the surface, at which a line is not drawn
RED, GREEN, BLUE = (190, 40, 40), (30, 130, 60), sheet.BLUE
GRID = (60, 60, 60)
CAPTION = (
    f"The frame and the tube of a stroke (radius {RADIUS}, intensity {INTENSITY}, quintic). Left:"
    " tangent u (red), v = n x u (green) and normal n (blue) along the path, and the grid of tube"
    f" samples p, of which {ROWS} rows and {COLUMNS} columns are drawn, those of the round ends"
    " besides. Right: where the stroke takes them, p', on the sculpted field"
)


def task(settings: Settings, folder: Path) -> Task:
    """The figure."""

    def make() -> Row:
        source, shape = read(), prepare(primitive(SHAPE))
        points = source["shapes"][SHAPE]["points"]
        stroke = Stroke(np.array(points), Brush(RADIUS, INTENSITY))
        edit = sculpt(shape, stroke)
        _, path = edit.problem.placed[0]
        tube = sample_tube(shape.field, stroke, path, ROWS, COLUMNS)
        size = settings.pixels
        fields = shape.field, edit.field
        before, after = map(_Drawing, fields, rendered.pictures(fields, CAMERA, size))
        before.grid(tube, tube.surface.points)
        before.line(path.points)
        for u in FRAMES:
            before.frame(path, u)
        after.grid(tube, tube.target.points)
        panels = {"frame and tube: p": before, "displaced tube: p'": after}
        labelled = [
            sheet.below([one.picture(), sheet.label(name, size)]) for name, one in panels.items()
        ]
        sheet.save(folder / "frame.png", sheet.beside(labelled))
        return {"pictures": ["frame"]}

    return Task("figure-frame", 15, make)


class _Drawing:
    """Lines on the picture of a field."""

    def __init__(self, field: Field, picture: Picture) -> None:
        self._field, size = field, len(picture)
        self._size, larger = size, (size * LARGER, size * LARGER)
        self._page = Image.fromarray(picture).resize(larger, Image.Resampling.BICUBIC)
        self._draw = ImageDraw.Draw(self._page)

    def picture(self) -> Picture:
        """All of it."""
        return np.array(self._page.resize((self._size, self._size), Image.Resampling.LANCZOS))

    def grid(self, tube: Tube, points: Array) -> None:
        """The rows and the columns of a tube's samples, where they can be seen."""
        places, seen = self._places(points), self._seen(points)
        for grid in (tube.grid, tube.grid.T):
            starts, ends = grid[:, :-1].ravel(), grid[:, 1:].ravel()
            shown = (starts >= 0) & (ends >= 0) & seen[starts] & seen[ends]
            for start, end in zip(places[starts[shown]], places[ends[shown]], strict=True):
                self._draw.line([tuple(start), tuple(end)], GRID, LARGER)

    def line(self, points: Array) -> None:
        """The path (N, 3)."""
        places = [tuple(place) for place in self._places(points)]
        self._draw.line(places, RED, 3 * LARGER, "curve")

    def frame(self, path: StrokePath, u: float) -> None:
        """The three axes at a point of the path."""
        at = int(np.argmin(np.abs(path.u - u)))
        axes = {"u": path.tangents, "v": path.laterals, "n": path.normals}
        for (name, way), color in zip(axes.items(), (RED, GREEN, BLUE), strict=True):
            start, end, letter = self._places(
                path.points[at] + np.array([[0.0], [LENGTH], [1.2 * LENGTH]]) * way[at]
            )
            sheet.pointed(self._draw, tuple(start), tuple(end), color, 2.5 * LARGER)
            halo = {"stroke_width": LARGER, "stroke_fill": "white"}
            large = sheet.font(sheet.LABEL * LARGER)
            self._draw.text(tuple(letter), name, color, large, anchor="mm", **halo)

    def _places(self, points: Array) -> Array:
        """On the larger page (N, 2), of points (N, 3)."""
        right, up, _ = CAMERA.axes
        away = points - np.array(CAMERA.target)
        flat = np.stack([away @ right, -(away @ up)], axis=1) / CAMERA.half
        return (flat + 1) / 2 * self._size * LARGER

    def _seen(self, points: Array) -> np.ndarray:
        """Whether nothing hides them (N,)."""
        right, up, toward = CAMERA.axes
        away = points - np.array(CAMERA.target)
        flat = np.clip(np.stack([away @ right, away @ up], axis=1) / CAMERA.half, -0.999, 0.999)
        first, hit = trace(self._field, CAMERA, flat)
        return ~hit | ((first - points) @ toward < HIDDEN)
