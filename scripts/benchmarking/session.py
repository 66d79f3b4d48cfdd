# SPDX-License-Identifier: GPL-3.0-or-later
"""The session benchmark: what many mixed strokes leave of the surface that none of them touched.

On each shape strokes of any brush, many of them over others, one upon another, from a numbered
seed. After 5, 20, 50 and 100 of them, or as many as there are:

untouched  share of the samples of the first surface that lie beyond 1.5 radii of every stroke and
           that none has covered or carved away, as a high one does which meets another part
drift      their distances from the surface now
normal     angles by which its normals have turned there, degrees: root mean square, and most
pieces     of the proxy at 128 cells, and at 256
layers_mb  all layers as bytes, compressed; file_mb: the field as a file
refused    strokes that ended with a reason
met        of those that were measured (every tenth), how many met the tolerance

Each stroke's processor seconds are those of all threads, its proxy's update included; seconds are
from its end to the new field. Lengths are in model space. At the end the last ten strokes are
compared with the first ten, each with those of the same finest level.
"""

import argparse
import json
import secrets
import statistics
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import random_strokes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from neural_sculpt_addon.field.edit.edit import Edit
    from neural_sculpt_addon.field.field import Field
    from neural_sculpt_addon.field.problem.prepare import Preparation
    from neural_sculpt_addon.stroke.stroke import Stroke

MARKS = (5, 20, 50, 100)
COLUMNS = (
    *("untouched", "drift_mean", "drift_p99", "drift_max", "normal_rms", "normal_max", "pieces"),
    *("fine_pieces", "layers_mb", "file_mb", "refused", "met", "measured"),
)
FAR = 1.5  # radii of every stroke
MEASURED = 10  # every so many strokes
WINDOW = 10  # strokes at the beginning and at the end that are compared
FINE = 256  # cells
SHOWN, SIZE = (20, 100), 480  # strokes after which pictures are taken, besides the start; pixels
FROM_BLENDER = {"seen_from": (0.55, -1.0, 0.45), "up": (0.0, 0.0, 1.0)}
FROM_ELSEWHERE = {"seen_from": (0.55, 0.45, 1.0), "up": (0.0, 1.0, 0.0)}  # Y is up there


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `benchmark.py session`."""
    parser.add_argument("--json", type=Path, help="write one object per stroke and per mark")
    parser.add_argument("--seed", type=int, help="of all strokes (default: a fresh one)")
    parser.add_argument("--strokes", type=int, default=MARKS[-1], help="default: %(default)s")
    parser.add_argument("--shapes", help="comma-separated (default: all)")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="and the strokes as files")
    parser.add_argument("--verbose", action="store_true", help="print every stroke")


def run(options: argparse.Namespace) -> None:
    """Print the table, and write the rows where `--json` says."""
    seed = secrets.randbelow(10_000) if options.seed is None else options.seed
    shapes = dict(random_strokes.fields())
    chosen = options.shapes.split(",") if options.shapes else list(shapes)
    if unknown := set(chosen) - set(shapes):
        sys.exit(f"There is no {', '.join(sorted(unknown))}; choose of {', '.join(shapes)}.")
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    print(f"seed {seed}, drift in 1e-3 of model space\n" + _line("shape", "strokes", COLUMNS))
    strokes, marks = [], []
    for shape in chosen:
        session = Session(shape, shapes[shape], seed)
        for mark in session.marks(options):
            marks.append(mark)
            print(_line(shape, mark["strokes"], [_short(mark, c) for c in COLUMNS]), flush=True)
        strokes += session.rows
        for reason, count in Counter(row.get("refused") for row in session.rows).items():
            if reason:
                print(f"{shape}: refused {count}: {reason}")
    _print_times(strokes)
    if options.json:
        rows = [*strokes, *marks]
        options.json.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


@dataclass
class Session:
    """One shape and the strokes on it so far."""

    shape: str
    start: "Field"
    seed: int
    rows: list[dict[str, Any]] = field(default_factory=list)
    strokes: "list[Stroke]" = field(default_factory=list)
    layer_bytes: int = 0

    def marks(self, options: argparse.Namespace) -> Iterator[dict[str, Any]]:
        """Draw the strokes; what is left at each mark."""
        import numpy as np

        from neural_sculpt_addon.field.problem.prepare import prepare
        from neural_sculpt_addon.field.problem.tube import COLUMNS, ROWS

        first = now = prepare(self.start)
        random = np.random.default_rng((self.seed, *self.shape.encode()))
        near = np.full(len(first.surface.points), np.inf)
        self.show(options.pictures, 0, now)
        for number in range(1, options.strokes + 1):
            stroke = random_strokes.mixed(now.field, now.surface, random)
            self.strokes.append(stroke)
            row, edit = self._sculpt(now, stroke, number)
            self.rows.append(row)
            if options.verbose:
                print(json.dumps(row), flush=True)
            if edit is not None:
                now = edit.preparation
                near = np.minimum(near, edit.problem.copies.distance(first.surface.points))
                swept = edit.problem.displaced_tubes(ROWS, COLUMNS).swept
                if swept is not None:
                    near[swept.swallows(first.surface.points)] = 0
            if number in (*SHOWN, options.strokes):
                self.show(options.pictures, number, now)
            if number in (*MARKS, options.strokes):
                yield self._mark(first, now, near > FAR)

    def _sculpt(
        self, before: "Preparation", stroke: "Stroke", number: int
    ) -> "tuple[dict[str, Any], Edit | None]":
        """A stroke's row, and what it made unless it is refused."""
        from neural_sculpt_addon.common.errors import SculptError
        from neural_sculpt_addon.field.checkpoint import layer_to_bytes
        from neural_sculpt_addon.field.edit.edit import sculpt
        from neural_sculpt_addon.field.mesh.pieces import components

        brush = stroke.brush
        row: dict[str, Any] = {
            "case": self.shape,
            "seed": self.seed,
            "stroke": number,
            "radius": brush.radius,
            "intensity": brush.intensity,
            "profile": brush.profile.to_json(),
            "modulation": brush.modulation.name,
            "mirrored": bool(stroke.mirror),
        }
        worked = time.process_time()
        try:
            edit = sculpt(before, stroke)
        except SculptError as error:
            return row | {"refused": str(error)}, None
        worked = time.process_time() - worked
        assert edit.layer is not None
        size = len(layer_to_bytes(edit.layer))
        self.layer_bytes += size
        row |= {
            "level": max(edit.layer),
            "coefficients": sum(len(part.index) for part in edit.layer.values()),
            "bytes": size,
            "seconds": edit.seconds,
            "processor_seconds": worked,
            "pieces": components(edit.proxy),
        }
        if number % MEASURED == 0:
            row["report"] = edit.report()
        return row, edit

    def _mark(
        self, first: "Preparation", now: "Preparation", far: "NDArray[np.bool_]"
    ) -> dict[str, Any]:
        """What is left after the strokes so far; `far` are the samples that none touched."""
        import numpy as np

        from neural_sculpt_addon.field.checkpoint import to_bytes
        from neural_sculpt_addon.field.geometry import angles
        from neural_sculpt_addon.field.mesh.pieces import components
        from neural_sculpt_addon.field.mesh.proxy import extract
        from neural_sculpt_addon.field.projection import find_surface

        samples = first.surface.where(far)
        found = find_surface(now.field, samples.points)
        turned = angles(found.normals, samples.normals)
        reports = [row["report"] for row in self.rows if "report" in row]
        mark = {
            "case": self.shape,
            "seed": self.seed,
            "strokes": len(self.rows),
            "untouched": float(far.mean()),
            "pieces": components(now.proxy),
            "fine_pieces": components(extract(now.field, FINE)),
            "layers_mb": self.layer_bytes / 1e6,
            "file_mb": len(to_bytes(now.field)) / 1e6,
            "refused": sum("refused" in row for row in self.rows),
            "met": sum(report["tolerance_met"] for report in reports),
            "measured": len(reports),
        }
        if not far.any():
            return mark
        return mark | {
            "drift_mean": float(found.distance.mean()),
            "drift_p99": float(np.percentile(found.distance, 99)),
            "drift_max": float(found.distance.max()),
            "drift_worst": samples.points[found.distance.argmax()].tolist(),
            "normal_rms": float(np.sqrt((turned**2).mean())),
            "normal_max": float(turned.max()),
            "normal_worst": samples.points[turned.argmax()].tolist(),
        }

    def show(self, folder: Path | None, number: int, now: "Preparation") -> None:
        """Pictures of the field from two sides, and the strokes so far as a file."""
        if folder is None:
            return
        import numpy as np
        from pictures import field_picture
        from PIL import Image

        from neural_sculpt_addon.stroke.file import dump_strokes

        about = FROM_BLENDER
        if self.shape in random_strokes.PRETRAINED:
            about = FROM_ELSEWHERE
        up = np.array(about["up"])
        front = np.array(about["seen_from"])
        back = 2 * (front @ up) * up - front
        cameras = [field_picture.Camera(tuple(side), about["up"]) for side in (front, back)]
        views = [field_picture.picture(now.field, camera, SIZE) for camera in cameras]
        Image.fromarray(np.concatenate(views, 1)).save(folder / f"{self.shape}-{number:03}.png")
        if self.strokes:
            path = folder / f"{self.shape}-{self.seed}.json"
            path.write_text(dump_strokes(self.strokes), encoding="utf-8")


def _print_times(rows: list[dict[str, Any]]) -> None:
    """Processor seconds of the last strokes by those of the first, level by level."""
    solved = [row for row in rows if "processor_seconds" in row]
    last = max((row["stroke"] for row in rows), default=0)
    early = [row for row in solved if row["stroke"] <= WINDOW]
    late = [row for row in solved if row["stroke"] > last - WINDOW and row["stroke"] > WINDOW]
    print(f"\nprocessor seconds of strokes 1 to {WINDOW}, and of the last {WINDOW}: medians")
    for level in sorted({row["level"] for row in early} & {row["level"] for row in late}):
        both = [[row for row in some if row["level"] == level] for some in (early, late)]
        before, after = (statistics.median(r["processor_seconds"] for r in some) for some in both)
        each = " and ".join(str(len(some)) for some in both)
        ratio = after / before
        print(f"level {level}: {before:.2f} and {after:.2f}, {ratio:.2f} times ({each} strokes)")
    if solved:
        median = statistics.median(row["seconds"] for row in solved)
        most = max(solved, key=lambda row: row["seconds"])
        where = f"{most['case']} {most['stroke']}"
        print(
            f"all {len(solved)}: seconds median {median:.2f}, most {most['seconds']:.1f} ({where})"
        )


def _line(shape: str, strokes: Any, cells: Any) -> str:
    return f"{shape:<9}{strokes:>8} " + " ".join(f"{cell:>11}" for cell in cells)


def _short(mark: dict[str, Any], column: str) -> str:
    if column not in mark:
        return "-"
    scale = 1e3 if column.startswith("drift") else 1.0
    return f"{scale * mark[column]:.3g}"
