# SPDX-License-Identifier: GPL-3.0-or-later
"""Disabling and enabling the extension while a stroke is computed: nothing is left when it is off.

Handlers, menus, classes, properties, keymaps, tools, timers, draw handlers, threads, processes,
files that are open, folders of the worker, attributes that previews write.
"""

import importlib
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..attacked import stressed_blender

COUNT = 200
ROLE = "blender"


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """`count` times; `seed` has nothing to do here."""
    failures: list[str] = []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        tempfile.tempdir = str(Path(name) / "temporary")
        Path(tempfile.tempdir).mkdir()
        harness = stressed_blender.install(Path(name))
        import bpy
        import numpy as np

        harness.SteeredCase.setUpClass()
        case: Any = harness.SteeredCase()
        case.setUp()
        operators: Any = bpy.ops
        enabled = disabled = None
        workers = 0
        for number in range(count):
            harness.stroke(np.eye(3) if number % 2 else np.array([[-1.0, 0.0, 1.0]]), name="One")
            workers += case.session.client.alive
            operators.preferences.addon_disable(module=harness.EXTENSION)
            disabled, before = _left(harness, case), disabled
            failures += [f"{number}, off: {text}" for text in _ours(disabled)]
            failures += [f"{number}, off: {text}" for text in _more(disabled, before)]
            operators.preferences.addon_enable(module=harness.EXTENSION)
            enabled, before = _left(harness, case), enabled
            failures += [f"{number}, on: {text}" for text in _more(enabled, before)]
            if number % 20 == 19:
                report(f"{number + 1} times, {len(failures)} failures")
        case.doCleanups()
        harness.SteeredCase.doClassCleanups()
        tempfile.tempdir = None
    return {"workers_at_work": workers, "failures": failures}


def _left(harness: Any, case: Any) -> dict[str, list[str]]:
    """What there is, by kind."""
    import bpy

    registration: Any = importlib.import_module("test_registration")
    tool, traces = registration.Tool(), registration.traces()
    found = {kind: [str(each) for each in _flat(value)] for kind, value in traces.items()}
    found["handlers"] = [
        f"{name} {getattr(handler, '__module__', handler)}"
        for name in dir(bpy.app.handlers)
        if isinstance(getattr(bpy.app.handlers, name), list)
        for handler in getattr(bpy.app.handlers, name)
    ]
    found["keymaps"] = [*tool.keys()]
    found["tools"] = [name for mode in ("OBJECT", "SCULPT") for name in tool.tools(mode) if name]
    found["timers"] = [*_timers(harness)]
    found["window manager"] = [
        name for name in dir(bpy.types.WindowManager) if name.startswith("neural_sculpt")
    ]
    found["threads"] = [
        *(thread.name for thread in threading.enumerate()),
        *(f"thread {number}" for number, _ in enumerate(os.listdir("/proc/self/task"))),
    ]
    found["processes"] = [f"process of neural_sculpt, state {state}" for state in _children()]
    found["files"] = [f"file {number}" for number, _ in enumerate(os.listdir("/proc/self/fd"))]
    found["folders"] = [path.name for path in Path(tempfile.gettempdir()).glob("neural_sculpt_*")]
    found["attributes"] = [
        name
        for mesh in bpy.data.meshes
        for name in mesh.attributes.keys()  # noqa: SIM118 - of Blender
        if "neural_sculpt" in name
    ]
    return found


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        for name, listed in value.items():
            yield from (f"{name} {each}" for each in listed)
    else:
        yield from value


def _timers(harness: Any) -> Iterator[str]:
    """Functions of the extension that wait for a timer."""
    import bpy

    known = bpy.app.timers.is_registered
    for name, module in [*sys.modules.items()]:
        if name.startswith(harness.EXTENSION):
            for word, value in vars(module).items():
                methods = [value, *(getattr(value, "__dict__", None) or {}).values()]
                if any(callable(each) and known(each) for each in methods):  # pyright: ignore[reportArgumentType]
                    yield f"{name}.{word}"


def _children() -> Iterator[str]:
    """States of the processes that this one has started."""
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = path.read_text().rpartition(")")[2].split()[:2]
        except OSError:  # it is gone
            continue
        if int(parent) == os.getpid():
            yield state


def _ours(found: dict[str, list[str]]) -> Iterator[str]:
    """What is the extension's."""
    for kind, listed in found.items():
        for each in listed:
            if "neural_sculpt" in each.lower() or "neural stroke" in each.lower():
                yield f"{kind}: {each} is left"


def _more(now: dict[str, list[str]], before: dict[str, list[str]] | None) -> Iterator[str]:
    """What is more than it was the last time."""
    for kind, listed in now.items():
        if before is not None and len(listed) > len(before[kind]):
            yield f"{kind}: {len(listed)} instead of {len(before[kind])}"
