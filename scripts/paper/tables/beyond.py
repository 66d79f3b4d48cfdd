# SPDX-License-Identifier: GPL-3.0-or-later
"""Table 5: what the paper could not do.

Profiles of many peaks, intensities at which methods tear, sessions of many strokes, and taking them
back one by one. Region preservation is in table 2c (drift and normals of the untouched surface).
Model space.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from benchmarking import random_strokes

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.checkpoint import to_bytes
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.levels import Coefficients
from neural_sculpt_addon.field.mesh.pieces import components
from neural_sculpt_addon.field.problem.pose import pose
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke

from ..edits import RADIUS, random_edit
from ..measures.chamfer import tube_of
from ..measures.ground import displaced_mesh
from ..measures.measures import angles, measure
from ..measures.surface import FieldSurface
from ..methods.methods import Method, Product, Scene, each_alone, ours
from ..methods.three_dns import ThreeDns
from ..settings import Settings
from ..work import Row, Task
from .table import Cell, Table

SHAPE = "sphere"
WIDE, LOW = 0.16, 0.03  # radius and intensity of strokes of many peaks
FAR = 1.5  # radii from all strokes of a session


def tasks(settings: Settings, scene: Callable[[str], Scene], _folder: Path) -> list[Task]:
    """All of them; what takes longest comes last."""
    stroke, second = Product("stroke", "paper", settings.quality), settings.quality * 0.08
    dns = ThreeDns("3DNS union", settings.quality, union=True)
    profiled, torn = [stroke, *ours()], [stroke, dns, *ours()]

    def session(name: str, seconds: float) -> Task:
        make = _session(name, scene, settings)
        return Task(f"beyond-session-{name}", settings.session * seconds, make, {name: make})

    def compared(
        key: str, seconds: float, make: Callable[[Sequence[Method]], Row], methods: list[Method]
    ) -> Task:
        return Task(f"beyond-{key}", seconds, partial(make, methods), each_alone(make, methods))

    def peaks(count: int) -> Task:
        make = _peaks(scene, count, settings)
        return compared(f"peaks-{count}", second + 12, make, profiled)

    def tear(height: float) -> Task:
        make = _torn(scene, height, settings)
        return compared(f"torn-{height:g}", 4 * second, make, torn)

    undo = _undo(scene, settings)
    return [
        *map(peaks, settings.peaks),
        Task("beyond-undo", 0.8 * settings.session, undo, {"local": undo}),
        session("local", 0.6),
        session("network", 1),
        *map(tear, settings.intensities),
        session("paper", settings.speed * 0.08),
    ]


def _peaks(
    scene: Callable[[str], Scene], count: int, settings: Settings
) -> Callable[[Sequence[Method]], Row]:
    """A stroke whose profile has so many peaks, each as high as the others."""

    def make(compared: Sequence[Method]) -> Row:
        here = scene(SHAPE)
        points = random_edit(here.preparation, 0, settings.seed).points
        stroke = Stroke(points, Brush(WIDE, LOW, peaked(count)))
        problem = pose(here.preparation, stroke)
        truth, tube = displaced_mesh(problem, here.dense), tube_of(problem)
        found: Row = {"peaks": count, "methods": {}}
        for method in compared:
            method.prepare(here)
            surface = method.edit(here, stroke).surface
            found["methods"][method.name] = {
                "bytes": surface.bytes,
                **measure(problem, surface, truth, tube, settings.samples // 5),
            }
        return found

    return make


def peaked(count: int) -> Profile:
    """Zeros and ones in turns, with zeros at both sides; Catmull-Rom between them."""
    return Profile(points=tuple((-1 + k / count, float(k % 2)) for k in range(2 * count + 1)))


def _torn(
    scene: Callable[[str], Scene], height: float, settings: Settings
) -> Callable[[Sequence[Method]], Row]:
    """A stroke so many radii high: pieces of the result, and what of the height is missing."""

    def make(compared: Sequence[Method]) -> Row:
        here = scene(SHAPE)
        stroke = random_edit(here.preparation, 1, settings.seed)
        stroke = replace(stroke, brush=replace(stroke.brush, intensity=height * RADIUS))
        problem = pose(here.preparation, stroke)
        target = np.concatenate([tube.target.points for tube in problem.tubes()])
        found: Row = {"height": height, "methods": {}}
        for method in compared:
            method.prepare(here)
            surface = method.edit(here, stroke).surface
            assert isinstance(surface, FieldSurface)
            distance = surface.see(target).distance
            found["methods"][method.name] = {
                "pieces": components(surface.proxy),
                "asked": float(distance.mean()),
                "asked_p95": float(np.percentile(distance, 95)),
            }
        return found

    return make


def _session(name: str, scene: Callable[[str], Scene], settings: Settings) -> Callable[[], Row]:
    """Strokes of any brush one upon another: what none of them came near."""
    epochs = settings.speed if name == "paper" else None

    def make() -> Row:
        first = now = scene(SHAPE).preparation
        random = np.random.default_rng(settings.seed)
        near, refused = np.full(len(first.surface.points), np.inf), 0
        for _ in range(settings.session):
            # All solvers get the same strokes: those of the unedited surface.
            stroke = random_strokes.mixed(first.field, first.surface, random)
            try:
                edit = sculpt(now, stroke, solver=name, epochs=epochs)
            except SculptError:
                refused += 1
                continue
            now = edit.preparation
            near = np.minimum(near, edit.problem.copies.distance(first.surface.points))
        far = first.surface.where(near > FAR)
        found = find_surface(now.field, far.points)
        turned = angles(found.normals, far.normals)
        return {
            "solver": name,
            "strokes": settings.session,
            "refused": refused,
            "untouched": float((near > FAR).mean()),
            "drift": float(found.distance.mean()),
            "drift_p99": float(np.percentile(found.distance, 99)),
            "turned": float(np.sqrt((turned**2).mean())),
            "pieces": components(now.proxy),
            "bytes": len(to_bytes(now.field)),
        }

    return make


def _undo(scene: Callable[[str], Scene], settings: Settings) -> Callable[[], Row]:
    """Strokes taken back one by one, last first: states that are the same to the last bit."""

    def make() -> Row:
        now = scene(SHAPE).preparation
        random = np.random.default_rng((settings.seed, 1))
        probes = np.concatenate([now.surface.points, now.shell.points, now.box.points])
        layers: list[Coefficients] = []
        states = [state_of(now.field, probes)]
        for _ in range(settings.session):
            try:
                edit = sculpt(now, random_strokes.mixed(now.field, now.surface, random))
            except SculptError:
                continue
            assert edit.layer is not None
            layers.append(edit.layer)
            now = edit.preparation
            states.append(state_of(now.field, probes))
        field, same = now.field, 0
        for layer, state in zip(reversed(layers), reversed(states[:-1]), strict=True):
            field = field.plus(layer, -1)
            same += state_of(field, probes) == state
        return {"strokes": len(layers), "same": same}

    return make


def state_of(field: Field, probes: np.ndarray) -> str:
    """What tells two fields apart: their values at `probes` (N, 3), all bits of them."""
    return hashlib.sha256(values(field, probes).tobytes()).hexdigest()


def tables(rows: Mapping[str, Row]) -> list[Table]:
    """One for each of the measurements."""
    return [
        table
        for table in (
            _peaks_table([r for k, r in rows.items() if k.startswith("beyond-peaks-")]),
            _torn_table([r for k, r in rows.items() if k.startswith("beyond-torn-")]),
            _session_table([r for k, r in rows.items() if k.startswith("beyond-session-")]),
            _undo_table([r for k, r in rows.items() if k == "beyond-undo"]),
        )
        if table.rows
    ]


def _peaks_table(rows: Sequence[Row]) -> Table:
    lines: list[tuple[Cell, ...]] = [
        (
            row["peaks"],
            name,
            *(1e3 * found[measure] for measure in ("asked", "asked_p95", "back", "drift")),
            found["normal"],
            found["bytes"] / 1e3,
        )
        for row in rows
        for name, found in row["methods"].items()
    ]
    return Table(
        "table-5a",
        "Table 5a: profiles of many peaks",
        ("peaks", "method", "asked", "asked p95", "back", "drift", "normals, °", "kB"),
        tuple(lines),
        f"1e-3 of model space. Radius {WIDE}, intensity {LOW}; peaks of the full height.",
    )


def _torn_table(rows: Sequence[Row]) -> Table:
    names = list(rows[0]["methods"]) if rows else []
    lines: list[tuple[Cell, ...]] = [
        (
            row["height"],
            row["height"] * RADIUS,
            *(row["methods"][name]["pieces"] for name in names),
            *(1e3 * row["methods"][name]["asked"] for name in names),
        )
        for row in rows
    ]
    return Table(
        "table-5b",
        "Table 5b: intensities at which methods tear",
        (
            *("intensity, radii", "intensity"),
            *(f"pieces: {name}" for name in names),
            *(f"asked: {name}" for name in names),
        ),
        tuple(lines),
        "Pieces of the result, of which there should be one; mean distance of displaced samples"
        " from it, 1e-3 of model space.",
    )


def _session_table(rows: Sequence[Row]) -> Table:
    rows = sorted(rows, key=lambda row: ("paper", "network", "local").index(row["solver"]))
    lines: list[tuple[Cell, ...]] = [
        (
            {"paper": "stroke"}.get(row["solver"], row["solver"]),
            row["strokes"],
            row["refused"],
            100 * row["untouched"],
            1e3 * row["drift"],
            1e3 * row["drift_p99"],
            row["turned"],
            row["pieces"],
            row["bytes"] / 1e3,
        )
        for row in rows
    ]
    return Table(
        "table-5c",
        "Table 5c: a session of strokes, one upon another",
        (
            *("method", "strokes", "refused", "untouched, %", "drift", "drift p99"),
            *("untouched normals, °", "pieces", "kB"),
        ),
        tuple(lines),
        f"Untouched is what lies beyond {FAR} radii of every stroke; 1e-3 of model space.",
    )


def _undo_table(rows: Sequence[Row]) -> Table:
    return Table(
        "table-5d",
        "Table 5d: strokes taken back one by one",
        ("strokes", "states that came back to the last bit"),
        tuple((row["strokes"], row["same"]) for row in rows),
        "By local, last stroke first. The others change weights, and keep copies to go back.",
    )
