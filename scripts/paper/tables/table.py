# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables as Markdown and as CSV: what a reader sees rounded, and the same in full."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

Cell = float | int | str | None


@dataclass(frozen=True)
class Table:
    """One table.

    name:   of its files
    rows:   each as long as `columns`; None where there is nothing to tell
    digits: significant ones, of floats in Markdown
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    about: str = ""
    digits: int = 3

    def markdown(self) -> str:
        """A heading, a paragraph and the table."""
        parts = [f"## {self.title}", self.about, self.grid()]
        return "\n\n".join(part for part in parts if part) + "\n"

    def grid(self) -> str:
        """The table alone, as Markdown."""
        lines = [
            _line(self.columns),
            _line(["---"] * len(self.columns)),
            *(_line([_short(cell, self.digits) for cell in row]) for row in self.rows),
        ]
        return "\n".join(lines)

    def csv(self) -> str:
        """The table with all digits."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(["" if cell is None else cell for cell in row] for row in self.rows)
        return out.getvalue()


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _short(cell: Cell, digits: int) -> str:
    if cell is None:
        return ""
    if not isinstance(cell, float):
        return str(cell)
    text = f"{cell:.{digits}g}"
    return f"{cell:.0f}" if "e+" in text else text
