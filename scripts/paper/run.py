# SPDX-License-Identifier: GPL-3.0-or-later
"""A run: the rows of all tables, then the tables as files."""

import json
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from neural_sculpt_addon.common.whole_file import write_whole

from . import beyond, figures, shapes, table1, table2, table3, table4
from .about import about, told
from .methods import Scene
from .settings import FULL, QUICK
from .work import Work, plan

MODULES = {"1": table1, "2": table2, "3": table3, "4": table4, "beyond": beyond, "figures": figures}
PAGE = "README.md"


def run(
    quick: bool,
    chosen: Sequence[str],
    work_folder: Path,
    out: Path,
    say: Callable[[str], None],
    only_plan: bool = False,
) -> None:
    """Make what is missing of the `chosen` tables, and write them to `out`.

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
    tasks = [task for name in chosen for task in MODULES[name].tasks(settings, scene, work_folder)]
    if only_plan:
        say(plan(len(tasks), [task for task in tasks if work.finished(task) is None]))
        return
    rows = work.do(tasks, say)
    tables = [table for name in chosen for table in MODULES[name].tables(rows)]
    out.mkdir(parents=True, exist_ok=True)
    parts = ["# The paper's tables\n", f"{told(facts)}\n"]
    for table in tables:
        write_whole(out / f"{table.name}.csv", table.csv().encode())
        parts.append(table.markdown())
    for name, picture in table4.figures(rows).items():
        write_whole(out / name, picture.encode())
        parts.append(f"![{Path(name).stem}]({name})\n")
    for name, caption in figures.pictures(rows).items():
        write_whole(out / f"{name}.png", (work_folder / f"{name}.png").read_bytes())
        parts.append(f"![{caption}]({name}.png)\n\n{caption}.\n")
    write_whole(out / PAGE, "\n".join(parts).encode())
    write_whole(out / "about.json", (json.dumps(facts, indent=1) + "\n").encode())
    say(f"Wrote {len(tables)} tables to {out}.")
