# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of work: one JSON file each in a folder, and a later run goes on from there."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.common.whole_file import write_whole

Row = dict[str, Any]
ABOUT = "about.json"


@dataclass(frozen=True)
class Task:
    """A row that is to be made.

    key:     names its file
    seconds: that it is expected to take, on two cores with nothing else to do
    make:    the row
    anew:    the row of one method alone, by its name; empty where methods are timed in turns
    """

    key: str
    seconds: float
    make: Callable[[], Row]
    anew: Mapping[str, Callable[[], Row]] = field(default_factory=dict)


class Work:
    """The folder of finished rows."""

    def __init__(self, folder: Path, about: Row) -> None:
        """Rows made under other conditions than `about` tells are refused. SculptError."""
        self._folder, self._about = folder, about
        path = folder / ABOUT
        if path.is_file() and _read(path) != about:
            raise SculptError(
                f"The rows in {folder} are of another machine, version or size of the run."
                " Name another folder by --work, or delete it."
            )

    def finished(self, task: Task) -> Row | None:
        """The row, where it has been made."""
        path = self._path(task.key)
        return _read(path) if path.is_file() else None

    def do(self, tasks: Sequence[Task], say: Callable[[str], None]) -> dict[str, Row]:
        """All rows by their keys; those that are not there are made, one after another."""
        left = [task for task in tasks if self.finished(task) is None]
        say(plan(len(tasks), left))
        self._folder.mkdir(parents=True, exist_ok=True)
        write_whole(self._folder / ABOUT, json.dumps(self._about, indent=1).encode())
        for number, task in enumerate(left, start=1):
            started = time.monotonic()
            row = task.make()
            self._write(task.key, row)
            took = time.monotonic() - started
            rest = sum(other.seconds for other in left[number:])
            say(f"{number}/{len(left)} {task.key}: {took:.0f} s; about {_span(rest)} left")
        return self.rows(tasks)

    def measure_anew(
        self, tasks: Sequence[Task], method: str, say: Callable[[str], None]
    ) -> dict[str, Row]:
        """All finished rows by their keys, with one method measured anew in each that compares it;
        what the others did stays. SculptError when there is no such row."""
        if not any(method in task.anew and self.finished(task) for task in tasks):
            raise SculptError(
                f"No finished row compares {method}. Make the rows first, without --anew, or"
                " name a method as the tables do."
            )
        for task in tasks:
            row, make = self.finished(task), task.anew.get(method)
            if row is not None and make is not None:
                new = make()
                if "methods" in row:
                    new["methods"] = {**row["methods"], **new["methods"]}
                self._write(task.key, new)
                say(task.key)
        return self.rows(tasks)

    def rows(self, tasks: Sequence[Task]) -> dict[str, Row]:
        """Those rows that are finished, by their keys."""
        rows = {task.key: self.finished(task) for task in tasks}
        return {key: row for key, row in rows.items() if row is not None}

    def take(self, record: Path) -> None:
        """Add rows from a file that `keep` wrote under the same conditions, if there is one."""
        if record.is_file() and (kept := _read(record))["about"] == self._about:
            self._folder.mkdir(parents=True, exist_ok=True)
            for key, row in kept["rows"].items():
                if not self._path(key).is_file():
                    self._write(key, row)

    def keep(self, record: Path, rows: Mapping[str, Row]) -> None:
        """Write rows by their keys as one file, one row on each line."""
        lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(row)}" for key, row in rows.items())
        text = f'{{"about": {json.dumps(self._about)},\n"rows": {{\n{lines}\n}}}}\n'
        write_whole(record, text.encode())

    def _write(self, key: str, row: Row) -> None:
        write_whole(self._path(key), json.dumps(row, indent=1).encode())

    def _path(self, key: str) -> Path:
        return self._folder / f"{key}.json"


def plan(count: int, left: Sequence[Task]) -> str:
    """What a run is going to do, in a sentence."""
    done = f"{count - len(left)} of {count} rows are finished"
    if not left:
        return f"{done}."
    seconds = sum(task.seconds for task in left)
    return f"{done}; the others take about {_span(seconds)} on two cores with nothing else to do."


def _span(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} seconds"
    return f"{seconds / 60:.0f} minutes" if seconds < 5400 else f"{seconds / 3600:.1f} hours"


def _read(path: Path) -> Row:
    return json.loads(path.read_text(encoding="utf-8"))
