# SPDX-License-Identifier: GPL-3.0-or-later
"""One stroke's way through the modules of the field: how often it returns to one already left.

A module is entered by a call from another one. What a map over pieces enters counts once for all
pieces. To read an attribute is no call, nor is to ask whether to go on. TOOLS, which all modules of
the field use, are on nobody's way. docs/architecture.md has the table.
"""

import inspect
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from functools import cached_property
from types import CodeType, FrameType

import numpy as np
import pytest

from neural_sculpt_addon.field import threads
from neural_sculpt_addon.field.edit.layers import State
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import Preparation, prepare
from neural_sculpt_addon.field.solve import spline_system
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.stroke import Stroke

FIELD = "neural_sculpt_addon.field."
TOOLS = {
    *("detail", "evaluate", "field", "geometry", "levels", "network", "projection"),
    *("threads", "mesh.extraction.lattice", "mesh.nearest", "mesh.surface", "problem.prepare"),
}
MAPS = {"in_pieces", "parallel"}
HOOKS = {"<lambda>"}  # that a caller hands on, to be asked whether to go on
MOST = 10


class Inline:
    """A pool that does its tasks at once, in this thread, where they are seen."""

    def submit(self, task: Callable, *given: object) -> Future:
        done = Future()
        done.set_result(task(*given))
        return done

    def map(self, task: Callable, *parts: Iterable) -> Iterator:
        return map(task, *parts)


class Way:
    """The modules that are entered, while it is the profile function."""

    def __init__(self) -> None:
        self.entered: list[str] = []
        self._stack: list[tuple[str, int]] = [("", 0)]  # where each call is, and in which map
        self._maps, self._seen = 0, set[tuple[int, str, str]]()
        self._attributes = attributes()

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            self._stack.append(self._come(frame.f_code, frame.f_globals.get("__name__", "")))
        elif event == "return" and len(self._stack) > 1:
            self._stack.pop()

    def _come(self, code: CodeType, name: str) -> tuple[str, int]:
        module, within = self._stack[-1]
        if not name.startswith(FIELD) or code.co_filename == "<string>":
            return module, within
        if code.co_name in MAPS and not within:
            self._maps += 1
            within = self._maps
        name = name.removeprefix(FIELD)
        if name in TOOLS or code.co_name in HOOKS or name == module:
            return module, within
        if code in self._attributes:
            return name, within
        if not within or (within, module, name) not in self._seen:
            self.entered.append(name)
        self._seen.add((within, module, name))
        return name, within


def attributes() -> set[CodeType]:
    """The code of all attributes of the field's classes that are worked out."""
    modules = [module for name, module in sys.modules.items() if name.startswith(FIELD)]
    classes = [each for one in modules for each in vars(one).values() if inspect.isclass(each)]
    every = [value for one in classes for value in vars(one).values()]
    codes = {value.fget.__code__ for value in every if isinstance(value, property) and value.fget}
    return codes | {value.func.__code__ for value in every if isinstance(value, cached_property)}


@pytest.fixture(scope="module")
def ball() -> Preparation:
    return prepare(primitive("sphere"))


@pytest.mark.parametrize(("brush", "finer"), [(Brush(0.08, 0.05), 0), (Brush(0.05, 0.1), 1)])
def test_it_returns_at_most_ten_times(ball, brush, finer, monkeypatch):
    """A smooth stroke, and a steep one, of which one more level is solved where it misses."""
    monkeypatch.setattr(threads, "pool", Inline)
    monkeypatch.setattr(spline_system, "pool", Inline)
    x = np.linspace(-0.3, 0.3, 7)
    y = 0.2 * np.sin(6 * x)
    stroke = Stroke(np.stack([x, y, np.sqrt(0.36 - x**2 - y**2)], axis=1), brush)
    state, way = State("", (), ball), Way()
    sys.setprofile(way)
    try:
        _, _, edit = state.sculpted(stroke, {})
    finally:
        sys.setprofile(None)
    assert edit.layer is not None
    assert len(edit.layer) == 2 + finer
    times = Counter(way.entered)
    assert {"edit.edit", "problem.problem", "solve.local", "mesh.proxy"} <= set(times)
    assert times.total() - len(times) <= MOST, times
