# SPDX-License-Identifier: GPL-3.0-or-later
"""A run: the rows of all tables, then the tables and figures as files, and a page of them."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

from pictures import sheet

from neural_sculpt_addon.common.whole_file import write_whole

from . import shapes
from .about import about, told
from .figures import figures
from .methods.methods import Scene
from .settings import FULL, QUICK
from .tables import beyond, main_table, table1, table2, table3, table4
from .tables.table import Table
from .work import Row, Task, Work, plan

MODULES = {"1": table1, "2": table2, "3": table3, "4": table4, "beyond": beyond, "figures": figures}
PAGE, GALLERY = "README.md", "gallery.png"
SHOWN = (
    "Stroke files of examples/, sculpted on the ready fields by `local` and rendered in Blender:"
    " ring, pumpkin, lizard's scales, an inscription cut by an asymmetric brush, robot, hair;"
    " `python3 scripts/gallery.py` makes this picture"
)


def run(
    quick: bool,
    chosen: Sequence[str],
    work_folder: Path,
    out: Path,
    say: Callable[[str], None],
    only_plan: bool = False,
    only_finished: bool = False,
    readme: Path | None = None,
    record: Path | None = None,
    anew: str | None = None,
) -> None:
    """Make what is missing of the `chosen` tables, and write them to `out`.

    only_plan:     tell what is missing, and make nothing
    only_finished: make no rows; the page tells which are missing
    readme:        gets the main table, too
    record:        a file of all rows, written once none is missing
    anew:          a method that is measured anew, alone, in the rows that are finished or recorded

    SculptError when the finished rows are of another machine or version.
    """
    settings = QUICK if quick else FULL
    if missing := [name for name in settings.shapes if not shapes.is_there(name)]:
        say(f"Left out, because their files are not there: {', '.join(missing)}.")
        settings = settings.without(missing)
    fits = work_folder / "fields"

    @cache
    def scene(name: str) -> Scene:
        return shapes.scene_of(name, fits, settings.cells)

    facts = about(settings)
    work = Work(work_folder, facts)
    if anew and record:
        work.take(record)
    tasks = [task for name in chosen for task in MODULES[name].tasks(settings, scene, work_folder)]
    if only_plan:
        say(plan(len(tasks), [task for task in tasks if work.finished(task) is None]))
        return
    if anew:
        rows = work.measure_anew(tasks, anew, say)
    else:
        rows = work.rows(tasks) if only_finished else work.do(tasks, say)
    if record and len(rows) == len(tasks):
        work.keep(record, rows)
    main = main_table.main_table(rows)
    tables = [*main, *(table for name in chosen for table in MODULES[name].tables(rows))]
    heading = ["# The paper's tables and figures\n", f"{told(facts)}\n"]
    note = f"Preliminary: {missing_of(tasks, rows)}." if len(rows) < len(tasks) else ""
    if note:
        heading.append(f"{note}\n")
    out.mkdir(parents=True, exist_ok=True)
    parts = [*heading, *_written(tables, out), *_drawn(rows, work_folder, out)]
    write_whole(out / PAGE, "\n".join(parts).encode())
    write_whole(out / "about.json", (json.dumps(facts, indent=1) + "\n").encode())
    if readme:
        text = main_table.replaced(readme.read_text(encoding="utf-8"), main, note)
        write_whole(readme, text.encode())
    say(f"Wrote {len(tables)} tables to {out}.")


def missing_of(tasks: Sequence[Task], rows: Mapping[str, Row]) -> str:
    """How many rows of each kind there are not."""
    kinds = [task.key.partition("-")[0] for task in tasks]
    left = [task.key.partition("-")[0] for task in tasks if task.key not in rows]
    counted = [f"{left.count(k)} of {kinds.count(k)} rows of {k}" for k in dict.fromkeys(left)]
    return f"{', '.join(counted)} are missing"


def _written(tables: Sequence[Table], out: Path) -> list[str]:
    """Tables as CSV files, and for the page."""
    for table in tables:
        write_whole(out / f"{table.name}.csv", table.csv().encode())
    return [table.markdown() for table in tables]


def _drawn(rows: Mapping[str, Row], folder: Path, out: Path) -> list[str]:
    """Figures as files, and for the page with their captions."""
    shown = []
    for name, (picture, caption) in table4.figures(rows).items():
        sheet.save(out / name, picture)
        shown.append((name, caption))
    for name, caption in figures.pictures(rows).items():
        drawn = folder / f"{name}.png"
        if drawn.is_file():  # a recorded row has its picture in `out` alone
            write_whole(out / drawn.name, drawn.read_bytes())
        shown.append((f"{name}.png", caption))
    if (out / GALLERY).is_file():
        shown.append((GALLERY, SHOWN))
    parts = [f"![{Path(name).stem}]({name})\n\n{caption}.\n" for name, caption in shown]
    return ["## Figures\n", *parts] if parts else []
