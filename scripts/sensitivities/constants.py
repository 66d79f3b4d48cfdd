# SPDX-License-Identifier: GPL-3.0-or-later
"""Another value of a constant, wherever a copy of it stands.

A constant is named by its module within the field and its own name, `solve.local.GAP`; a field of
one that is a tuple or a data class by one word more, `fit.fit.BENEATH_DETAIL.steps`. Modules that
import it by name have a copy, and so have functions with it as the default of a parameter. Both are
found in the sources.
"""

import ast
import dataclasses
import importlib
import inspect
import pkgutil
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from importlib.util import resolve_name
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

PACKAGE = "neural_sculpt_addon.field"

LEVELS = {
    "solve.resolution.LEAST_FINEST",
    "solve.resolution.LEAST_WITH_WALLS",
    "fit.fit_detail.FIT_COARSEST",
    "fit.strays.HIDDEN_LEVEL",
    *(f"fit.fit_repair.{name}" for name in ("REPAIR_COARSEST", "REPAIR_FINEST")),
    *(f"edit.absorption.{name}" for name in ("LARGEST_CELLS", "CLEARED")),
    "edit.patch.FINEST_PATCH",
}
"""Levels: with one less cells are twice as large, with one more half."""


class Constant(NamedTuple):
    """Where a constant stands.

    part: the field of it that is meant, empty if it is a number
    """

    module: str
    name: str
    part: str

    @property
    def title(self) -> str:
        """What a table calls it: without the rooms that it stands in."""
        return ".".join(filter(None, (self.module.rpartition(".")[2], self.name, self.part)))

    @property
    def value(self) -> Any:
        """The number that it is now."""
        whole = getattr(importlib.import_module(self.module), self.name)
        return getattr(whole, self.part) if self.part else whole


def find(name: str) -> Constant:
    """The constant that a table calls `name`."""
    words = name.split(".")
    place = next(number for number, word in enumerate(words) if word.isupper())
    module = ".".join([PACKAGE, *words[:place]])
    return Constant(module, words[place], "".join(words[place + 1 :]))


def others(name: str) -> Iterator[float]:
    """Half of a constant and twice, of whole numbers whole ones."""
    value = find(name).value
    for other in (value - 1, value + 1) if name in LEVELS else (value / 2, value * 2):
        whole = round(other) if isinstance(value, int) else other
        if whole != value:
            yield whole


@contextmanager
def changed(name: str, value: float) -> Iterator[None]:
    """Another value of a constant in all of its copies, until the block ends."""
    constant = find(name)
    usual: Any = getattr(importlib.import_module(constant.module), constant.name)
    other = _replaced(usual, constant.part, value) if constant.part else value
    with ExitStack() as usual_values:
        for module, local in holders(constant):
            usual_values.callback(setattr, module, local, usual)
            setattr(module, local, other)
            for function, parameters in defaulted(module, local):
                usual_values.enter_context(_defaults(function, parameters, other))
        yield


def holders(constant: Constant) -> list[tuple[ModuleType, str]]:
    """The modules that have it by name, and the names: its own first."""
    own = importlib.import_module(constant.module), constant.name
    return [own, *_importers()[constant.module, constant.name]]


@cache
def _importers() -> dict[tuple[str, str], list[tuple[ModuleType, str]]]:
    """The modules that import something by its name, and the names that it has there; by the module
    that it comes from and its name there."""
    found = defaultdict[tuple[str, str], list[tuple[ModuleType, str]]](list)
    for module, tree in sources().items():
        for node in tree.body:
            if isinstance(node, ast.ImportFrom):
                source = "." * node.level + (node.module or "")
                source = resolve_name(source, module.__package__)
                for one in node.names:
                    found[source, one.name].append((module, one.asname or one.name))
    return found


def defaulted(module: ModuleType, name: str) -> Iterator[tuple[FunctionType, list[str]]]:
    """The functions of a module that have `name` as a default, and the parameters that do."""
    for node, function in _functions(sources()[module].body, module):
        given = node.args.posonlyargs + node.args.args
        pairs = [
            *zip(reversed(given), reversed(node.args.defaults), strict=False),
            *zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True),
        ]
        chosen = [
            one.arg
            for one, default in pairs
            if isinstance(default, ast.Name) and default.id == name
        ]
        if chosen:
            yield inspect.unwrap(function), chosen


@cache
def sources() -> dict[ModuleType, ast.Module]:
    """The modules of the field, with their syntax."""
    package = importlib.import_module(PACKAGE)
    found = pkgutil.walk_packages(package.__path__, f"{PACKAGE}.")
    modules = [package, *(importlib.import_module(one.name) for one in found)]
    return {module: ast.parse(inspect.getsource(module)) for module in modules}


def _functions(body: list[ast.stmt], owner: Any) -> Iterator[tuple[ast.FunctionDef, Any]]:
    """The functions of a module or class, those of its classes too."""
    for node in body:
        if isinstance(node, ast.FunctionDef):
            yield node, getattr(owner, node.name)
        elif isinstance(node, ast.ClassDef):
            yield from _functions(node.body, getattr(owner, node.name))


def _replaced(whole: Any, part: str, value: float) -> Any:
    """A tuple or data class with another value of a field."""
    replaced = getattr(whole, "_replace", None) or partial(dataclasses.replace, whole)
    return replaced(**{part: value})


@contextmanager
def _defaults(function: FunctionType, parameters: list[str], value: Any) -> Iterator[None]:
    """Another default of some parameters of a function, until the block ends."""
    usual, named = function.__defaults__, function.__kwdefaults__
    count = function.__code__.co_argcount
    places = function.__code__.co_varnames[:count][count - len(usual or ()) :]
    function.__defaults__ = tuple(
        value if name in parameters else default
        for name, default in zip(places, usual or (), strict=True)
    )
    if named is not None:
        function.__kwdefaults__ = {**named, **{name: value for name in parameters if name in named}}
    try:
        yield
    finally:
        function.__defaults__, function.__kwdefaults__ = usual, named
