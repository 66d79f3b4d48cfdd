# SPDX-License-Identifier: GPL-3.0-or-later
"""Turn scored cases (a `cases.json`) into stroke files: python3 scripts/read_cases.py FOLDER."""

import argparse
import json
from pathlib import Path

from benchmarking.scored_cases import add_option, read_case
from workshop import environment


def main() -> None:
    """Write one stroke file for each case into the given folder."""
    parser = argparse.ArgumentParser(description="Turn scored cases into stroke files.")
    parser.add_argument("folder", type=Path, help="where the stroke files go")
    add_option(parser)
    options = parser.parse_args()
    environment.enter("worker")
    from neural_sculpt_addon.stroke.file import dump_strokes
    from neural_sculpt_addon.stroke.stroke import Stroke

    try:
        cases = json.loads(options.cases.read_text(encoding="utf-8"))["cases"]
    except (OSError, ValueError, KeyError) as error:
        raise SystemExit(f"{options.cases} cannot be read as cases: {error!r}.") from error
    options.folder.mkdir(parents=True, exist_ok=True)
    for case in cases:
        path = options.folder / f"{case['id']}.json"
        path.write_text(dump_strokes([Stroke.from_json(read_case(case))]), encoding="utf-8")
        print(f"{case['model']}: {path}")


if __name__ == "__main__":
    main()
