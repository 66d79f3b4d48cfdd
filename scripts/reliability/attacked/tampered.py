# SPDX-License-Identifier: GPL-3.0-or-later
"""Tampered .blends in Blender as a module; the attack `tampered` reads what is printed.

    python scripts/in_blender/start.py reliability.attacked.tampered FOLDER SEED FIRST COUNT

FOLDER is an empty one for the extension and the files.
"""

import faulthandler
import logging
import os
import sys
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

from ..mutations import mutated
from . import stressed_blender

LONGEST = 600  # characters of a sentence
OPERATORS = 8  # of a file, for the worker has the most of them to do
LEFT_OUT = {
    *("install_worker", "cancel_installation", "open_log", "open_presets"),  # not of a file
    *("draw", "notice", "watch_release", "no_drag", "stop_worker", "restart_worker"),
    *("add", "from_mesh", "good_enough", "import_preset"),
    "consolidate",  # takes minutes, of the same state as export
}
GIVEN: dict[str, dict[str, Any]] = {
    "stroke": {
        "stroke_json": '{"version": 1, "strokes": [{"points": [[0.3, 0.1, 0.5], [0.3, 0.2, 0.5]],'
        ' "radius": 0.1, "intensity": 0.03}]}'
    },
    "remesh": {"resolution": 32},
    "set_strength": {"strength": 0.5},
    "edit_stroke": {"intensity": 0.1},
    "resize": {"length": "RADIUS", "factor": 1.1},
}
VALUES = (
    *(0, -1, 7, 2**31 - 1, -(2**31), 0.5, -0.0, float("nan"), float("inf"), 1e300),
    *(
        "",
        "x",
        "\n",
        "x" * 100_000,
        "[" * 5000,
        "[]",
        "{}",
        "null",
        '{"points": NaN}',
        "\u202e%s{}",
    ),
    *(b"", b"\x00", b"\xff" * 1000, [1, 2, 3], [0.5, float("nan")], {"a": 1}),
)


class Said(logging.Handler):
    """Defects that the extension logs."""

    def __init__(self) -> None:
        """None so far."""
        super().__init__(logging.WARNING)
        self.defects: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep one that has a trace, or that nobody can act upon."""
        text = record.getMessage()
        if record.exc_info:
            self.defects.append(f"{text}: {record.exc_info[1]!r}")
        elif "report this" in text:
            self.defects.append(text)


class Layout:
    """Takes what a panel draws, for there is no window."""

    def __getattr__(self, name: str) -> "Layout":
        """Any member."""
        return self

    def __call__(self, *_: object, **__: object) -> "Layout":
        """Any call."""
        return self


class Place:
    """The context, with a sidebar that has a width."""

    def __getattr__(self, name: str) -> Any:
        """As in Blender."""
        import bpy

        if name == "region":
            return types.SimpleNamespace(width=300)
        if name == "preferences":
            addons = bpy.context.preferences.addons
            return types.SimpleNamespace(addons=addons, system=types.SimpleNamespace(ui_scale=1.0))
        return getattr(bpy.context, name)


def good(harness: Any, path: Path) -> None:
    """A file with a field that has strokes and absorbed sculpting, and curves of the brush."""
    import bpy

    operators: Any = bpy.ops
    operators.wm.read_homefile(use_empty=True, use_factory_startup=True)
    addon: Any = bpy.context.preferences.addons[harness.EXTENSION]
    addon.preferences.resolution = harness.RESOLUTION
    ob = harness.add("SPHERE")
    for number, tilt in enumerate((0.0, 0.5)):
        harness.stroke(harness.arc(ob, tilt=tilt), name=f"Stroke {number}", intensity=0.05)
    points = harness.vertices(ob)
    points[points[:, 2] < -0.3] *= 1.05
    ob.data.vertices.foreach_set("co", points.ravel())
    operators.neural_sculpt.absorb()
    operators.neural_sculpt.mute_stroke(uid=ob.neural_sculpt.strokes[0].uid)
    ob.neural_sculpt.report = '{"name": "Two", "error_mean": 0.1}'
    operators.wm.save_as_mainfile(filepath=str(path))


def groups() -> Iterator[Any]:
    """All that the extension keeps in the file, as Blender keeps it."""
    import bpy

    for owner in (*bpy.data.objects, *bpy.data.scenes):
        kept = owner.bl_system_properties_get()
        if kept and "neural_sculpt" in kept:
            yield kept["neural_sculpt"]
    yield from bpy.data.meshes


def tamper(random: Random) -> str:
    """Change one to four values; which."""
    told = []
    for _ in range(random.choice((1, 1, 2, 4))):
        group = random.choice([*groups()])
        listed = group.get("strokes")
        if isinstance(listed, list) and listed and random.random() < 0.6:
            group = random.choice(listed)
        keys = [*group.keys()]
        if not keys:
            continue
        key = random.choice(keys)
        value = changed(group[key], random)
        told.append(f"{key} = {value!r:.60}")
        del group[key]
        if value is not None:
            try:
                group[key] = value
            except (TypeError, OverflowError, ValueError):  # Blender has no such property
                told[-1] += " (missing)"
    return ", ".join(told)


def changed(value: Any, random: Random) -> Any:
    """Another value in the place of one; None for none."""
    if random.random() < 0.1:
        return None
    if isinstance(value, bytes) and random.random() < 0.7:
        return mutated(value, random)
    if isinstance(value, str) and random.random() < 0.5:
        return mutated(value.encode(), random).decode(errors="replace").replace("\x00", "")
    return random.choice(VALUES)


def attempts(harness: Any, folder: Path, random: Random) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Names of operators and panels, and what tries them."""
    import bpy

    registration = harness.module("blender.registration")
    operators: Any = bpy.ops
    for cls in registration.CLASSES:
        if issubclass(cls, bpy.types.Panel):
            yield cls.__name__, lambda cls=cls: draw(cls)
    names = {
        cls.bl_idname.partition(".")[2]
        for cls in registration.CLASSES
        if issubclass(cls, bpy.types.Operator)
    }
    for name in random.sample(sorted(names - LEFT_OUT), OPERATORS):
        operator, given = getattr(operators.neural_sculpt, name), GIVEN.get(name, {})
        if name == "export":
            given = {"filepath": str(folder / "out.pth")}
        yield name, lambda operator=operator, given=given: operator("EXEC_DEFAULT", **given)
        if name in {"edit_stroke", "remesh", "absorb", "export"}:
            yield f"{name} dialog", lambda operator=operator: operator("INVOKE_DEFAULT")
    for step in (harness.undo, harness.undo, harness.redo):
        yield step.__name__, step


def draw(cls: Any) -> None:
    """Draw a panel onto nothing."""
    import bpy

    panel: Any = types.SimpleNamespace(layout=Layout(), bl_space_type="VIEW_3D")
    if not hasattr(cls, "poll") or cls.poll(bpy.context):
        for name in ("draw_header", "draw"):
            if name in vars(cls):
                vars(cls)[name](panel, Place())


def attempt(name: str, work: Callable[[], Any]) -> str:
    """What went wrong; empty when it worked or said why not."""
    try:
        work()
    except RuntimeError as error:
        text = str(error).removeprefix("Error: ").strip()
        if "Traceback" in text or "Python:" in text or "report this" in text:
            return f"{name}: {text[-300:]}"
        if len(text) > LONGEST:
            return f"{name}: a sentence of {len(text)} characters, {text[:80]}"
    except Exception as error:  # noqa: BLE001 - which is what the attack looks for
        return f"{name}: {error!r:.300}"
    return ""


def main(given: list[str]) -> None:
    """Tamper with as many files as the command line says."""
    folder, seed, first, count = Path(given[0]), *given[1:]
    faulthandler.enable()
    harness = stressed_blender.install(folder)
    stressed_blender.tell_version()
    import bpy

    operators: Any = bpy.ops
    sound, path = folder / "sound.blend", folder / "tampered.blend"
    good(harness, sound)
    said = Said()
    logging.getLogger().addHandler(said)
    for number in range(int(first), int(first) + int(count)):
        print(f"sequence {number} begins", flush=True)
        random = Random(f"{seed} {number}")
        operators.wm.open_mainfile(filepath=str(sound))
        told = tamper(random)
        operators.wm.save_as_mainfile(filepath=str(path), copy=True)
        operators.wm.open_mainfile(filepath=str(path))
        tries, wrong = 0, []
        for what, work in attempts(harness, folder, random):
            said.defects.clear()
            tries += 1
            problem = attempt(what, work)
            wrong += [problem] if problem else [f"{what}: {text}" for text in said.defects]
        if wrong:
            text = " ".join(f"{'; '.join(wrong[:3])} after {told}".split())
            print(f"sequence {number} fails: {text}", flush=True)
        else:
            print(f"sequence {number} ends: {tries}", flush=True)
    sys.stdout.flush()
    os._exit(0)
