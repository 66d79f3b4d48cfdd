# SPDX-License-Identifier: GPL-3.0-or-later
"""The measurement of constants: another value reaches every copy, and no number is forgotten."""

import ast
import importlib
import re
import sys
from fractions import Fraction
from pathlib import Path

import pytest
import sensitivity
from sensitivities import constants, left_out, table
from sensitivities.subject import Made, Subject

from neural_sculpt_addon.field import projection
from neural_sculpt_addon.field.edit import absorption, brushed
from neural_sculpt_addon.field.fit import fit, fit_detail
from neural_sculpt_addon.field.mesh.refinement.refine import refine
from neural_sculpt_addon.field.solve import local, spline_system

FIELD = Path(projection.__file__).parent
ROOMS = ("edit", "fit", "mesh", "problem", "solve")
MEASURED = {
    name
    for subject in sensitivity.SUBJECTS
    for name in importlib.import_module(f"sensitivities.{subject}").SUBJECT.names
}
"""All constants that some table has."""


def numbers():
    """The numbers of the field's rooms that have a name in capitals, with their modules."""
    for path in (path for room in ROOMS for path in (FIELD / room).rglob("*.py")):
        module = ".".join(path.relative_to(FIELD).with_suffix("").parts)
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.Assign):
                names = [one.id for one in ast.walk(node.targets[0]) if isinstance(one, ast.Name)]
                for name in names:
                    value = getattr(sys.modules[f"{constants.PACKAGE}.{module}"], name)
                    if name.isupper() and isinstance(value, int | float):
                        yield f"{module}.{name}"


def test_each_number_is_measured_or_said_to_be_left_out():
    constants.sources()  # imports all modules
    left = [
        f"{module}.{name}"
        for some in left_out.WHY.values()
        for module, names in some.items()
        for name in names
    ]
    assert len(set(left)) == len(left)
    assert not MEASURED & set(left)
    rooms = {name for name in (*MEASURED, *left) if name.split(".")[0] in ROOMS}
    assert set(numbers()) == {name for name in rooms if not constants.find(name).part}


def test_the_document_has_rows_of_each_measured_constant_as_it_is():
    text = (FIELD.parent.parent / "docs/sensitivity.md").read_text("utf-8")
    rows = re.findall(r"^\| `([\w.]+)` \| (\S+) →", text, re.MULTILINE)
    found = {(title, f"{float(Fraction(value)):g}") for title, value in rows}
    measured = map(constants.find, MEASURED)
    assert found == {(constant.title, f"{constant.value:g}") for constant in measured}


def test_measured_constants_are_numbers_with_another_half_and_double():
    for name in MEASURED:
        value = constants.find(name).value
        assert isinstance(value, int | float)
        assert value not in list(constants.others(name)), name


def test_nothing_is_made_of_measured_constants_when_modules_are_imported():
    used = {
        (module, node.id)
        for module, tree in constants.sources().items()
        for node in at_import(tree)
        if isinstance(node, ast.Name)
    }
    for name in MEASURED:
        assert not used & set(constants.holders(constants.find(name))), name


def at_import(node):
    """What is looked at when a module is imported, without defaults that are only a name."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Name) and isinstance(child.ctx, ast.Store):
            continue
        if isinstance(child, ast.FunctionDef | ast.Lambda):
            defaults = [*child.args.defaults, *filter(None, child.args.kw_defaults)]
            yield from (one for one in defaults if not isinstance(one, ast.Name))
            for default in defaults:
                yield from at_import(default)
        else:
            yield child
            yield from at_import(child)


def test_another_value_is_in_every_module_that_imports_the_constant():
    with constants.changed("fit.fit_detail.ITERATIONS", 77):
        assert (fit_detail.ITERATIONS, absorption.ITERATIONS) == (77, 77)
        assert (local.ITERATIONS, spline_system.ITERATIONS) == (20, 20)
    assert (fit_detail.ITERATIONS, absorption.ITERATIONS) == (10, 10)
    with constants.changed("projection.ARRIVED", 0.5):
        assert (projection.ARRIVED, brushed.ARRIVED) == (0.5, 0.5)


def test_another_value_is_in_every_default_too_and_goes_again():
    usual, also = refine.__defaults__, spline_system.solve_level.__defaults__
    with constants.changed("mesh.refinement.refine.EDGE_TOLERANCE", 0.5):
        assert refine.__defaults__[0] == 0.5
        assert refine.__defaults__[1:] == usual[1:]
    with constants.changed("solve.spline_system.CONVERGED", 0.5):
        assert spline_system.solve_level.__defaults__ == (*also[:-1], 0.5)
    assert refine.__defaults__ == usual
    assert spline_system.solve_level.__defaults__ == also


def test_a_part_of_a_constant_changes_alone():
    usual = fit.BENEATH_DETAIL
    with constants.changed("fit.fit.BENEATH_DETAIL.steps", 7):
        assert (fit.BENEATH_DETAIL.steps, fit.BENEATH_DETAIL.rate) == (7, usual.rate)
    assert fit.BENEATH_DETAIL is usual
    closeness = brushed.CLOSE_ENOUGH
    with constants.changed("edit.brushed.CLOSE_ENOUGH.slope", 7.0):
        assert tuple(brushed.CLOSE_ENOUGH) == (closeness.distance, 7.0)
    assert brushed.CLOSE_ENOUGH is closeness


def test_a_value_is_as_before_when_a_case_fails():
    with pytest.raises(ZeroDivisionError), constants.changed("solve.local.GAP", 9.0):
        raise ZeroDivisionError
    assert local.GAP == 1.5


def test_a_table_tells_means_of_ratios_and_sums_of_what_cases_make():
    def solved(scale):
        gap = local.GAP
        return Made(bytes([round(10 * gap)]), lambda: {"error": scale * gap**2, "pieces": 2})

    subject = Subject(
        cases=lambda count, _, more: [lambda: solved(1 + more), lambda: solved(5)][:count],
        count=2,
        constants={"solve.local": ("GAP",)},
        ratios=("error",),
        sums=("pieces",),
    )
    rows = [line.split(" | ") for line in table.lines(subject, subject.names, 2, 0)]
    found = [(row[0].strip("| "), row[1].strip(), *row[3:]) for row in rows if len(row) > 1]
    assert found == [
        ("constant", "value", "error", "pieces", "refused", "changed |"),
        ("as it is", "", "1.00", "4", "0", "0 |"),
        ("other samples", "", "1.41", "4", "0", "0 |"),
        ("other samples", "", "1.73", "4", "0", "0 |"),
        ("other samples", "", "2.00", "4", "0", "0 |"),
        ("`local.GAP`", "1.5 → 0.75", "0.25", "4", "0", "2 |"),
        ("`local.GAP`", "1.5 → 3", "4.00", "4", "0", "2 |"),
    ]
