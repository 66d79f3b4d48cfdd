# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutated files of each kind that is read: each loads or is refused with one short sentence.

Strokes, presets, layers, fields (.safetensors with and without detail, .pth), points and meshes.
Any other exception, a message over LONGEST characters or one with a trace, SECONDS of the
processor or MEGABYTES of memory are failures.
"""

import io
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from ..mutations import mutated

COUNT = 20_000  # of each kind
ROLE = "worker"
LONGEST = 400  # characters of a refusal
SECONDS = 20.0  # of the processor, for one file
MEGABYTES = 6000  # at most, of this process

Read = Callable[[bytes], object]


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` files of each kind: how many loaded and were refused, the most time and memory."""
    import resource

    failures: list[str] = []
    totals = {"loaded": 0, "refused": 0, "broken": 0}
    slowest = 0.0
    with tempfile.TemporaryDirectory() as folder:
        kinds = _kinds(Path(folder))
        for kind, (good, read) in kinds.items():
            read(good)  # what is mutated is sound
            for number in range(count):
                data = mutated(good, Random(f"{seed} {kind} {number}"))
                started = time.process_time()
                outcome, problem = _outcome(read, data)
                spent = time.process_time() - started
                slowest = max(slowest, spent)
                if spent > SECONDS:
                    outcome, problem = "broken", f"took {spent:.0f} s of the processor"
                totals[outcome] += 1
                if problem:
                    failures.append(f"{kind} {number} (seed {seed}): {problem}")
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
            report(f"{kind}: {count} files, slowest {slowest:.1f} s, {memory} MB")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
    if memory > MEGABYTES:
        failures.append(f"Reading took {memory} MB.")
    tries = count * len(kinds)
    return {"tries": tries, "kinds": len(kinds), **totals, "peak_MB": memory, "failures": failures}


def _outcome(read: Read, data: bytes) -> tuple[str, str]:
    """Whether data loaded, was refused or broke something, and how."""
    from neural_sculpt_addon.common.errors import SculptError

    try:
        read(data)
    except SculptError as error:
        text = str(error)
        if not 0 < len(text) <= LONGEST or "Traceback" in text:
            return "broken", f"a refusal of {len(text)} characters: {text[:120]}"
        return "refused", ""
    except Exception as error:  # noqa: BLE001 - which is what the attack looks for
        return "broken", f"{type(error).__name__}: {error!s:.120}"
    return "loaded", ""


def _kinds(folder: Path) -> dict[str, tuple[bytes, Read]]:
    """A sound file of each kind, and its reader."""
    from neural_sculpt_addon.field import checkpoint, points_file
    from neural_sculpt_addon.field.layer_bytes import layer_from_bytes
    from neural_sculpt_addon.field.mesh import mesh_file
    from neural_sculpt_addon.interaction.preset_file import BUILT_IN, dump_preset, parse_preset
    from neural_sculpt_addon.stroke.file import parse_strokes

    strokes, layer, fields, points, meshes = _sound(folder)

    def from_file(name: str, read: Callable[[Path], object]) -> Read:
        def write_and_read(data: bytes) -> object:
            path = folder / name
            path.write_bytes(data)
            return read(path)

        return write_and_read

    return {
        "strokes": (strokes, lambda data: parse_strokes(data.decode(errors="replace"))),
        "preset": (
            dump_preset(BUILT_IN[0]).encode(),
            lambda data: parse_preset(data.decode(errors="replace")),
        ),
        "layer": (layer, layer_from_bytes),
        **{name: (data, from_file(name, checkpoint.load)) for name, data in fields.items()},
        "points.npy": (points, from_file("points.npy", points_file.read)),
        **{name: (data, from_file(name, mesh_file.read)) for name, data in meshes.items()},
    }


def _sound(
    folder: Path,
) -> tuple[bytes, bytes, dict[str, bytes], bytes, dict[str, bytes]]:
    """Bytes of a stroke file, a layer, field files, points and meshes."""
    import numpy as np
    import trimesh

    from neural_sculpt_addon.field import checkpoint
    from neural_sculpt_addon.field.detail import Detail
    from neural_sculpt_addon.field.field import Field
    from neural_sculpt_addon.field.layer_bytes import layer_to_bytes
    from neural_sculpt_addon.field.levels import COARSEST, UNIT, Level, cells_per_axis
    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.file import dump_strokes
    from neural_sculpt_addon.stroke.stroke import Stroke

    random = np.random.default_rng(0)
    points = random.uniform(-0.5, 0.5, (8, 3))
    strokes = dump_strokes([Stroke(points, Brush(0.1, 0.05), name="One")]).encode()
    n = cells_per_axis(COARSEST)
    index = (n**3 // 2 + n**2 // 2 + n // 2 + np.arange(-2, 3)).astype(np.int32)
    values = (UNIT * np.arange(-2, 3)).astype(np.float32)
    coefficients = {COARSEST: Level(index, values)}
    network = primitive("sphere").network
    fields = {}
    for name, field in (
        ("plain.safetensors", Field(network)),
        ("detail.safetensors", Field(network, Detail.of(coefficients))),
        ("field.pth", Field(network)),
    ):
        checkpoint.save(field, folder / name)
        fields[name] = (folder / name).read_bytes()
    array = io.BytesIO()
    np.save(array, points)
    mesh, meshes = trimesh.creation.icosahedron(), {}
    for suffix in ("ply", "obj", "stl", "off", "glb"):
        data = mesh.export(file_type=suffix)
        meshes[f"mesh.{suffix}"] = data.encode() if isinstance(data, str) else data
    meshes["text.ply"] = mesh.export(file_type="ply", encoding="ascii")
    text: Any = mesh.export(file_type="stl_ascii")
    meshes["text.stl"] = text.encode()
    return strokes, layer_to_bytes(coefficients), fields, array.getvalue(), meshes
