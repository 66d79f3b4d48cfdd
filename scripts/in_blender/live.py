# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of live absorption inside Blender: brushes a field, measures what it takes in.

blender --enable-event-simulate --python scripts/in_blender/start.py -- \\
    in_blender.live EXTENSION.zip COUNT CELLS ROWS.json
"""

import json
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from . import call_times
from . import simulated_input as hand
from .call_times import ended, timed, times
from .extension import add, fields, install, module, worker_session
from .simulated_input import Steps

ASSETS = "brushes/essentials_brushes-mesh_sculpt.blend/Brush/"
BRUSHES = (
    *("Draw", "Smooth", "Grab", "Inflate/Deflate", "Clay Strips", "Crease Sharp"),
    *("Flatten/Contrast", "Scrape/Fill", "Blob", "Drag Cloth"),
)
SIZE = 30  # pixels, radius of the brushes: 0.07 model units
EACH = 3  # strokes with each brush that are measured
LIFTED = 0.1  # seconds that an artist has the pen in the air
LENGTH = 0.1  # of a stroke, model units
POINTS = 6  # of the mouse in a stroke
PAUSE = 0.03  # seconds at each of them, as of a hand
SECONDS = 600
STAGES = ("noticed", "asked", "answered", "in the scene")
"""Of a stroke, after Blender's brush has ended: the extension looks at the mesh, the worker has the
job, its answer is there, the undo step is made."""
TIMED = {
    "blender.session.absorption.live": ("look_later", "look"),
    "blender.session.absorption.brush_results": ("take",),
    "blender.scene.native_steps": ("take_back",),
    "blender.scene.commit": ("push_undo",),
    "blender.scene.kept_steps": ("settle",),
    "blender.session.absorption.renewal": ("go_on", "renew_proxy"),
}

rows: list[dict[str, Any]] = []
reached: dict[str, float] = {}
"""When the last stroke came to each of its STAGES, on the clock of `time.perf_counter`."""
counts = [0, 0]
"""Strokes that became steps of ours, and those that kept Blender's."""
brushed: list[dict[str, Any]] = []
"""Of each stroke that came into the scene: the vertices of its part, before, brushed, absorbed."""


def instrument() -> None:
    """Time the calls, and keep what strokes were."""
    live, results = (
        module("blender.session.absorption.live"),
        module("blender.session.absorption.brush_results"),
    )
    for name in ("enter_next", "keep_next"):
        setattr(results, name, kept(getattr(results, name), name == "keep_next"))
    for name, functions in TIMED.items():
        for function in functions:
            label = function.replace("_", " ")
            timed(module(name), function, lambda _, label=label: label)
    session = worker_session()
    timed(session, "poll_once", lambda _: "poll once")
    look, hear, is_at_work = live.look, session.hear, live.is_at_work

    def looked() -> None:
        now, jobs = time.perf_counter(), len(session.jobs)
        look()
        if len(session.jobs) > jobs:
            reached["noticed"], reached["asked"] = now, time.perf_counter()

    def heard(message: Any) -> None:
        if message.kind == "result":
            reached["answered"] = time.perf_counter()
        hear(message)

    def ends(*_: object) -> None:
        """Blender tells of a change when the brush that made it has just ended."""
        if "ended" not in reached and not is_at_work():
            reached["ended"] = time.perf_counter()

    live.look, session.hear = looked, heard
    bpy.app.handlers.depsgraph_update_post.insert(0, ends)
    time_evaluations()


def time_evaluations() -> None:
    """Time what Blender does anew after each change, among it what it does for its brushes."""
    began = [0.0, 0.0]

    def begins(*_: object) -> None:
        began[:] = time.perf_counter(), time.thread_time()

    def ends(*_: object) -> None:
        clock, work = time.perf_counter() - began[0], time.thread_time() - began[1]
        times["evaluation"].append((1000 * clock, 1000 * work))

    bpy.app.handlers.depsgraph_update_pre.append(begins)
    bpy.app.handlers.depsgraph_update_post.insert(0, ends)


def kept(bring: Any, is_kept: bool) -> Any:
    """A function that brings the first stroke of a proxy into the scene; what that was is kept."""

    def brings(target: Any, proxy: Any) -> None:
        stroke, base = proxy.strokes[0], proxy.positions
        given = {"part": stroke.part, "report": stroke.result.fields["report"]}
        remade = not is_kept and proxy.count == 1 and "vertices" in stroke.result.arrays
        bring(target, proxy)
        brushed.append({**given, "name": stroke.name, "remade": remade, "base": base})
        counts[is_kept] += 1

    return brings


def main(given: list[str]) -> None:
    """Let Blender step it."""
    hand.play(steps(*given))


def steps(extension: str, count: str, cells: str, file: str) -> Steps:
    """Install, brush, print."""
    yield from install(extension, int(cells))
    instrument()
    bpy.context.preferences.edit.undo_steps = 256
    bpy.context.preferences.system.viewport_aa = "OFF"  # software would draw without end
    hand.look()
    yield from add("SUZANNE")
    with bpy.context.temp_override(window=hand.window(), area=hand.view_area()):
        bpy.ops.object.mode_set(mode="SCULPT")
        bpy.ops.ed.undo_push(message="Sculpt Mode")
    yield 5 * hand.DRAWN
    vertices = len(fields()[0].data.vertices)
    print(f"\nBlender {bpy.app.version_string}, {vertices:,} vertices", flush=True)
    generator = np.random.default_rng(0)
    print(
        f"{'brush':18} {'strokes':>7} {'vertices':>8} {'mean':>7} {'95 %':>7} {'field':>7}"
        f" {'drift':>7} {'pieces':>7} {'remade':>7}   "
        + " ".join(f"{stage:>12}" for stage in (*STAGES, "of it solving"))
    )
    for name in BRUSHES:
        yield from measure(name, generator, worker_session())
    yield from in_a_row(int(count), generator, worker_session())
    stretched = module("blender.scene.mesh.proxy_mesh").STRETCHED
    yield from hand.until(lambda: stretched not in fields()[0].data, SECONDS, "its own proxy")
    rows.extend(call_times.table(20))
    Path(file).write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def measure(name: str, generator: np.random.Generator, session: Any) -> Steps:
    """Some strokes with one brush, each when the last one is in the field."""
    results = []
    take(name)
    yield 2 * hand.DRAWN
    for _ in range(EACH):
        brushed.clear()
        yield from stroke(generator)
        yield from hand.until(lambda: bool(brushed), SECONDS, f"{name} in the field")
        yield from hand.until(lambda: not session.jobs, SECONDS, "an idle worker")
        reached["in the scene"] = ended["take"]
        stages = [reached[stage] - reached["ended"] for stage in STAGES]
        solving = brushed[0]["report"]["seconds"]
        results.append((*compare(brushed[0]), *stages, solving))
    means = np.mean([result[:5] for result in results], axis=0)
    pieces, remade = (sum(result[i] for result in results) for i in (5, 6))
    seconds = np.median([result[7:] for result in results], axis=0).tolist()
    counted, *lengths = means
    print(
        f"{name:18} {EACH:7} {counted:8.0f} "
        + " ".join(f"{1000 * v:7.3f}" for v in lengths)
        + f" {pieces:+7} {remade:7}   "
        + " ".join(f"{second:12.3f}" for second in seconds),
        flush=True,
    )
    keys = ("vertices", "mean", "p95", "field", "drift")
    row = dict(zip(keys, means.tolist(), strict=True))
    rows.append({"brush": name, **row, "pieces": pieces, "remade": remade})
    rows[-1].update(zip((*STAGES, "solving"), seconds, strict=True))


def compare(done: dict[str, Any]) -> tuple[Any, ...]:
    """Of one stroke: vertices moved; distance of the brushed mesh from the result, mean and 95 %,
    and of the field; of the rest of the surface from what it was; pieces more; remade or not."""
    part, report = done["part"], done["report"]
    mesh = fields()[0].data
    now = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", now)
    now = now.reshape(-1, 3)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.attributes[".corner_vert"].data.foreach_get("value", corners)
    low, high = part.after.min(0) - 0.05, part.after.max(0) + 0.05
    near = ((now > low) & (now < high)).all(1)
    used, local = np.unique(
        corners.reshape(-1, 3)[near[corners.reshape(-1, 3)].all(1)], return_inverse=True
    )
    tree = BVHTree.FromPolygons(now[used].tolist(), local.reshape(-1, 3).tolist())
    changed = (part.before != part.after).any(1)
    away = np.array([distance(tree, p) for p in part.after[changed].tolist()])
    if done["remade"]:
        ring = part.after[~changed]
        drift = float(np.mean([distance(tree, p) for p in ring.tolist()]))
    else:
        rest = np.ones(len(done["base"]), bool)
        rest[part.vertices] = False
        drift = float(np.abs(now - done["base"])[rest].max())
    pieces = report["components_after"] - report["components_before"]
    return (
        changed.sum(),
        away.mean(),
        float(np.quantile(away, 0.95)),
        report["error_mean"],
        drift,
        pieces,
        int(done["remade"]),
    )


def distance(tree: BVHTree, point: list[float]) -> float:
    """Of a point from a mesh."""
    found = tree.find_nearest(point)[3]
    return float("inf") if found is None else found


def in_a_row(count: int, generator: np.random.Generator, session: Any) -> Steps:
    """Strokes of all brushes in turn, without a pause."""
    history = module("blender.scene.sculpt_steps").steps
    before, steps_before = len(fields()[0].neural_sculpt.strokes), len(history()[0])
    started = time.perf_counter()
    brushed.clear()
    for number in range(count):
        if number % 5 == 0:
            take(BRUSHES[number // 5 % len(BRUSHES)])
            yield hand.DRAWN
        yield from stroke(generator)
        yield LIFTED
    drawn = time.perf_counter() - started

    def rests() -> bool:
        proxies = module("blender.session.absorption.brush_results").proxies
        return session.rests and not any(proxy.strokes for _, proxy in proxies.each())

    yield from hand.until(rests, SECONDS, "all strokes in the field")
    total, added = time.perf_counter() - started, len(fields()[0].neural_sculpt.strokes) - before
    undo_steps = len(history()[0]) - steps_before
    errors = [done["report"]["error_mean"] for done in brushed]
    worst = 1000 * max(errors, default=0.0)
    edited = module("blender.scene.mesh.native_edits").edited(fields()[0])
    print(
        f"\n{count} strokes in {drawn:.1f} s: {added} entries and {undo_steps} undo steps after"
        f" {total:.1f} s, mean distance at most {worst:.3f}, edited: {edited};"
        f" of all strokes {counts[1]} kept their steps, {counts[0]} did not"
    )
    rows.append(
        {
            "strokes": count,
            "entries": added,
            "steps": undo_steps,
            "drawn": drawn,
            "seconds": total,
            "worst": worst / 1000,
        }
    )


def stroke(generator: np.random.Generator) -> Steps:
    """One short stroke somewhere on the surface in sight."""
    start, end = places(generator)
    path = hand.to_window(start + part * (end - start) for part in np.linspace(0, 1, POINTS))
    looks = len(times["look"])
    reached.clear()
    yield from hand.drag(path, pause=PAUSE)
    yield from hand.until(lambda: len(times["look"]) > looks, SECONDS, "the end of a stroke")


def places(generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Two points on the surface, LENGTH apart as seen from the front."""
    ob = fields()[0]
    while True:
        x, z = generator.uniform(-0.5, 0.5, 2)
        angle = generator.uniform(0, 2 * np.pi)
        ways = (0.0, LENGTH)
        seen = [(x + way * np.cos(angle), -3, z + way * np.sin(angle)) for way in ways]
        hits = [ob.ray_cast(origin, (0, 1, 0)) for origin in seen]
        if all(hit[0] and hit[2][1] < -0.6 for hit in hits):
            return np.array(hits[0][1]), np.array(hits[1][1])


def take(name: str) -> None:
    """Take one of Blender's brushes in hand."""
    area = hand.view_area()
    context = {"window": hand.window(), "area": area, "region": hand.region("WINDOW", area)}
    given: Any = {"asset_library_type": "ESSENTIALS", "relative_asset_identifier": ASSETS + name}
    with bpy.context.temp_override(**context):
        bpy.ops.wm.tool_set_by_id(name="builtin.brush")
        bpy.ops.brush.asset_activate(**given)
    settings: Any = bpy.context.tool_settings
    unified = getattr(settings.sculpt, "unified_paint_settings", None)
    (unified or settings.unified_paint_settings).size = 2 * SIZE  # across
