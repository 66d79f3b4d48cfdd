# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface benchmark inside Blender: draws strokes and times the extension's calls.

blender --enable-event-simulate --python scripts/in_blender/start.py -- \\
    in_blender.interface EXTENSION.zip COUNT CELLS ROWS.json MODE

The file gets what is printed: a row for each call, one for each wait, one for each reading of the
memory.
"""

import json
import os
from collections.abc import Generator
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from . import call_times
from . import simulated_input as hand
from .call_times import ended, line, named, timed
from .extension import add, fields, install, module, worker_session
from .simulated_input import Steps

DRAWN = 5  # strokes by hand that are timed
MOVES = 40  # of the mouse in each
HOVERS = 0.3  # seconds that the brush is seen where a stroke will begin
RADIUS = 0.6  # of the sphere field
SECONDS = 600
READINGS = 8  # of the memory, and one before the first stroke

looked: list[int] = []
"""How many vertices each move of the pen, and each moment's rest after it, looked at."""
rows: list[dict[str, Any]] = []
"""Of all tables."""


def instrument() -> None:
    """Time the calls that Blender makes. The overlay's are registered again."""
    overlay, draw = module("blender.viewport.overlay"), module("blender.operators.strokes.draw")
    overlay.unregister()
    timed(overlay.handler, "draw", lambda _: "overlay: stroke")
    timed(overlay, "draw_brush", lambda _: "overlay: brush")
    overlay.register()
    timed(draw.NEURAL_SCULPT_OT_draw, "modal", lambda given: f"event: {given[2].type.lower()}")
    modal = draw.NEURAL_SCULPT_OT_draw.modal

    def with_arguments(self: Any, context: Any, event: Any) -> Any:  # which Blender counts
        return modal(self, context, event)

    draw.NEURAL_SCULPT_OT_draw.modal = with_arguments
    timed(worker_session().watcher, "timer", lambda _: "timer tick")
    preview = module("blender.scene.mesh.preview").preview
    timed(preview, "show", lambda _: "preview")
    timed(preview, "draw", lambda _: "surface under the pen, a move")
    timed(preview, "timer", lambda _: "surface under the pen, at rest")
    displaced = module("interaction.displaced").Displaced
    advance = displaced.advance

    def counted(self: Any, most: int | None = None) -> int:
        count = advance(self, most)
        if most:
            looked.append(count)
        return count

    displaced.advance = counted
    timed(module("blender.session.stroke_jobs"), "add_entry", lambda _: "result into the scene")
    timed(module("blender.scene.next_proxy"), "prepare", lambda _: "result made ready")


def main(given: list[str]) -> None:
    """Let Blender step it."""
    hand.play(steps(*given))


def steps(extension: str, count: str, cells: str, file: str, mode: str) -> Steps:
    """Install, draw, print."""
    yield from install(extension, int(cells))
    instrument()
    hand.look()
    yield from add("SPHERE")
    session = worker_session()
    with bpy.context.temp_override(window=hand.window(), area=hand.view_area()):
        operators: Any = bpy.ops
        operators.object.mode_set(mode=mode)
        bpy.ops.ed.undo_push(message="Mode")
        bpy.ops.wm.tool_set_by_id(name="neural_sculpt.tool")
    triangles = len(fields()[0].data.polygons)
    print(f"\nBlender {bpy.app.version_string}, {triangles:,} triangles", flush=True)
    waits = []
    for number in range(DRAWN):
        waits.append((yield from draw(number)))
        yield from hand.until(lambda: not session.jobs, SECONDS, "the final result")
    _print_times(waits)
    yield from remember(int(count), session)
    Path(file).write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def draw(number: int) -> Generator[float, None, tuple[float, float]]:
    """Draw one stroke by hand: ms from its end to the result in the scene, and drawn."""
    tilt = -0.5 + number / DRAWN
    path = hand.to_window(arc(tilt, MOVES))
    strokes = len(fields()[0].neural_sculpt.strokes)
    hand.move(path[0])
    yield HOVERS
    yield from hand.drag(path, pause=0.01)
    released = ended["event: leftmouse"]

    def is_there() -> bool:
        return len(fields()[0].neural_sculpt.strokes) > strokes

    yield from hand.until(is_there, SECONDS, "a result")
    seen = ended["result into the scene"]
    hand.view_area().tag_redraw()
    yield from hand.until(lambda: ended["overlay: stroke"] > seen, SECONDS, "a drawn result")
    return 1000 * (seen - released), 1000 * (ended["overlay: stroke"] - released)


def arc(tilt: float, count: int) -> np.ndarray:
    """Points (N, 3) over the front of the sphere."""
    angle = np.linspace(-0.4, 0.4, count)
    c, s = np.cos(tilt), np.sin(tilt)
    return RADIUS * np.stack([np.sin(angle), -np.cos(angle) * c, np.cos(angle) * s], 1)


def remember(count: int, session: Any) -> Steps:
    """Many strokes in a row, each as soon as the last one shows; the memory meanwhile."""
    generator = np.random.default_rng(0)
    names, refused = ("strokes", "blender_mb", "worker_mb", "refused"), 0
    print(f"\n{'strokes':>8} {'Blender MB':>11} {'worker MB':>10} {'refused':>8}")
    operators: Any = bpy.ops
    for number in range(count + 1):
        if number % max(1, count // READINGS) == 0:
            row = number, megabytes(os.getpid()), megabytes(session.client.pid), refused
            print("{:8} {:11.0f} {:10.0f} {:8}".format(*row), flush=True)
            rows.append(dict(zip(names, row, strict=True)))
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        kept = [
            {"name": "", "location": p, "radius_factor": 1, "intensity_factor": 1}
            for p in on_proxy(arc(0.0, 12) @ turn).tolist()
        ]
        sign = generator.choice([-1, 1])
        operators.neural_sculpt.stroke(points=kept, radius=0.06, intensity=0.01 * sign)
        job = session.jobs[-1]
        yield from hand.until(lambda job=job: not job.pending, SECONDS, f"stroke {number}")
        if job.status == "failed":
            refused += 1
            print(f"stroke {number} was refused: {job.message}", flush=True)


def on_proxy(points: np.ndarray) -> np.ndarray:
    """Where rays from far outside towards the middle, through points (N, 3), meet the proxy."""
    bpy.context.view_layer.update()
    ob, found = fields()[0], []
    for point in points:
        hit, place, _, _ = ob.ray_cast((3 * point).tolist(), (-point).tolist())
        found.append(place if hit else point)
    return np.array(found)


def megabytes(process: int) -> float:
    """Memory that a process holds."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _print_times(waits: list[tuple[float, float]]) -> None:
    rows.extend(call_times.table(36))
    if looked:
        counts = np.percentile(looked, (50, 95, 100)).tolist()
        print(f"{'vertices looked at under the pen':36} {len(looked):6} {line(counts)}", flush=True)
        rows.append({"count": "vertices under the pen", "times": len(looked), **named(counts)})
    ends = ("stroke's end to result", "stroke's end to its picture")
    for label, values in zip(ends, zip(*waits, strict=True), strict=True):
        clock = np.percentile(values, (50, 95, 100)).tolist()
        print(f"{label:36} {len(values):6} {line(clock)}", flush=True)
        rows.append({"wait": label, "times": len(values), "clock": named(clock)})
