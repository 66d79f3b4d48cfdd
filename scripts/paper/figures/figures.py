# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of one edit by all methods, rendered by Blender; drift is drawn from the fields.

methods  one stroke of radius 0.08 and intensity 0.06, the first random edit of the sphere
drift    the same, coloured by how far the surface moved where the stroke does not reach: a decade
         a step of colour, from 1e-6 (white) to 1e-2 (dark red); the stroke itself is grey
peaks    a stroke whose profile has five peaks

`families`, `frame` and `sequence` show strokes of ours alone.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from pictures import field_picture, rendered, sheet
from pictures.sheet import Picture

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.problem.metrics import FAR
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.problem.problem import Problem
from neural_sculpt_addon.field.projection import find_surface, project
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke

from ..edits import random_edit
from ..measures.surface import FieldSurface
from ..methods.methods import Method, Product, Scene, ours
from ..methods.three_dns import ThreeDns
from ..settings import Settings
from ..tables.beyond import LOW, WIDE, peaked
from ..tables.table import Table
from ..work import Row, Task
from . import families, frame, sequence

SHAPE, PEAKS = "sphere", 5
LEAST, MOST = 1e-6, 1e-2  # of the colours of drift
COLOURS = np.array([[255, 255, 255], [254, 224, 144], [244, 109, 67], [165, 0, 38]], float)
STROKE_COLOUR = 165.0
COLUMNS = 3
BAR = 16  # pixels, height of the colours that a legend shows
CAPTIONS = {
    "sequence": sequence.CAPTION,
    "frame": frame.CAPTION,
    **{name: family.caption for name, family in families.FAMILIES.items()},
    "peaks": f"A profile of five peaks of one height, radius {WIDE}, intensity {LOW}: what is"
    " left of it in a network of 70 kB, and in local detail (table 5a)",
    "methods": "One stroke by all methods: radius 0.08, intensity 0.06, quintic, the first random"
    " edit of the sphere (table 2)",
    "drift": "The same: how far the surface moved where the stroke does not reach, in model space."
    " The stroke is grey; where nothing moved the ball is white, in its own shade",
}


def tasks(settings: Settings, scene: Callable[[str], Scene], folder: Path) -> list[Task]:
    """One for each picture."""
    size = settings.pixels
    dns = ThreeDns("3DNS", settings.quality), ThreeDns("3DNS union", settings.quality, union=True)
    stroke = Product("stroke", "paper", settings.quality)

    def first() -> Row:
        here = scene(SHAPE)
        edit = random_edit(here.preparation, 0, settings.seed)
        fields = _edited([stroke, *dns, *ours()], here, edit)
        problem, camera = pose(here.preparation, edit), _camera(edit)
        drift = {n: drift_map(problem, f, camera, size) for n, f in fields.items()}
        sheet.save(folder / "methods.png", _page(_shaded(fields, camera, size)))
        sheet.save(folder / "drift.png", sheet.below([_page(drift), _scale(size)]))
        return {"pictures": ["methods", "drift"]}

    def peaks() -> Row:
        here = scene(SHAPE)
        points = random_edit(here.preparation, 0, settings.seed).points
        edit = Stroke(points, Brush(WIDE, LOW, peaked(PEAKS)))
        fields = _edited([stroke, *ours()], here, edit)
        camera = _camera(edit)
        sheet.save(folder / "peaks.png", _page(_shaded(fields, camera, size)))
        return {"pictures": ["peaks"]}

    epoch = 0.08 + 0.17 + 0.17
    return [
        sequence.task(settings, folder),
        frame.task(settings, folder),
        *families.tasks(settings, folder),
        Task("figure-peaks", settings.quality * 0.08 + 30, peaks),
        Task("figure-methods", settings.quality * epoch + 60, first),
    ]


def tables(_rows: Mapping[str, Row]) -> list[Table]:
    """None."""
    return []


def pictures(rows: Mapping[str, Row]) -> dict[str, str]:
    """What each picture shows, by the name of its file without suffix."""
    some = [row for key, row in rows.items() if key.startswith("figure-")]
    return {name: CAPTIONS[name] for row in some for name in row["pictures"]}


def drift_map(
    problem: Problem, edited: Field, camera: field_picture.Camera, size: int
) -> np.ndarray:
    """The edited field (size, size, 3), coloured by its distance from the unedited one."""
    axis = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(axis, -axis)
    points, hit = field_picture.trace(edited, camera, np.stack([x.ravel(), y.ravel()], axis=1))
    found = project(edited, points[hit])  # rays end up to 2e-4 beside it
    places = found.points
    colours = np.full((size * size, 3), 255.0)
    moved = coloured(find_surface(problem.field, places).distance)
    moved[problem.copies.distance(places) <= FAR] = STROKE_COLOUR
    toward = np.clip(found.normals @ camera.axes[2], 0, 1)
    colours[hit] = moved * (0.55 + 0.45 * toward[:, None])
    return colours.reshape(size, size, 3).astype(np.uint8)


def coloured(distance: np.ndarray) -> np.ndarray:
    """Colours (N, 3) from 0 to 255 of distances (N,), by their logarithms."""
    decades = np.log10(np.clip(distance, LEAST, MOST) / LEAST) / np.log10(MOST / LEAST)
    steps = np.linspace(0, 1, len(COLOURS))
    return np.stack([np.interp(decades, steps, channel) for channel in COLOURS.T], axis=1)


def _edited(methods: list[Method], here: Scene, edit: Stroke) -> dict[str, Field]:
    found = {}
    for method in methods:
        method.prepare(here)
        surface = method.edit(here, edit).surface
        assert isinstance(surface, FieldSurface)
        found[method.name] = surface.field
    return found


def _camera(edit: Stroke) -> field_picture.Camera:
    """Looks at the middle of the stroke, a little from the side."""
    x, y, z = edit.points.mean(axis=0)
    aside = np.cross((x, y, z), (0.0, 0.0, 1.0))
    seen = np.array([x, y, z]) - 0.35 * aside
    return field_picture.Camera((float(seen[0]), float(seen[1]), float(seen[2])), half=0.72)


def _shaded(
    fields: Mapping[str, Field], camera: field_picture.Camera, size: int
) -> dict[str, Picture]:
    drawn = rendered.pictures([*fields.values()], camera, size)
    return dict(zip(fields, drawn, strict=True))


def _page(cells: Mapping[str, Picture]) -> Picture:
    """Rows of pictures, each with its name below."""
    named = [sheet.below([cell, sheet.label(name, cell.shape[1])]) for name, cell in cells.items()]
    rows = [named[at : at + COLUMNS] for at in range(0, len(named), COLUMNS)]
    return sheet.below([sheet.beside(row) for row in rows])


def _scale(width: int) -> Picture:
    """The colours of drift, and what they stand for."""
    across = np.geomspace(LEAST, MOST, width)
    strip = np.tile(coloured(across).astype(np.uint8), (BAR, 1, 1))
    strip[[0, -1]] = strip[:, [0, -1]] = sheet.PALE
    ends = sheet.label("1e-6 or less", width // 3), sheet.label("1e-2 or more", width // 3)
    return sheet.beside([ends[0], strip, ends[1]])
