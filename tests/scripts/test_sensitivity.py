# SPDX-License-Identifier: GPL-3.0-or-later
"""The measurement of constants: another value reaches every module that uses the constant."""

import ast
from pathlib import Path

import sensitivity

FIELD = Path(__file__).parents[2] / "neural_sculpt_addon" / "field"
SOLVER = ("problem", "solve")
"""Rooms that the solution of a stroke goes through; what others import serves something else."""


def imports():
    """Modules of the solver, with the module that each imports a name from, and the name."""
    for path in (path for room in SOLVER for path in (FIELD / room).glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                source = (node.module or "").rpartition(".")[2]
                for alias in node.names:
                    yield f"{path.parent.name}.{path.stem}", source, alias.name


def test_constants_are_set_in_all_modules_of_the_solver_that_import_them():
    found = {name: set() for name in sensitivity.NAMES}
    for module, source, constant in imports():
        for name, users in found.items():
            if name.split(".")[-2:] == [source, constant]:
                users.add(module)
    wanted = {name: set(sensitivity.ALSO.get(name, ())) for name in sensitivity.NAMES}
    assert found == wanted
