# SPDX-License-Identifier: GPL-3.0-or-later
"""The document on reliability, written from the record of the attacks."""

from collections.abc import Mapping
from typing import Any

from workshop import ROOT

DOCUMENT = ROOT / "docs" / "reliability.md"

_HEAD = """\
# Reliability

Nothing that an artist did is lost, and nothing that comes from outside breaks Blender:

- A stroke that is being computed when the worker dies is computed again. When it fails twice, it is
  in the history, muted, and the message names it.
- A file that is saved while strokes wait for their results has them, muted.
- A result reaches the scene whole or not at all, and a file is written whole or not at all.
- What arrives damaged, from a file or from the worker, is refused with a sentence that says what
  to do. It runs nothing, and it asks for no more memory than its reader allows.
- No network socket is opened, but by the installation of the worker when the artist asks for it
  (`tests/worker/test_sockets.py`).

`python3 scripts/stress.py` attacks these promises and counts what breaks. The tests do the same
with fewer tries. `--only NAME` chooses attacks, `--json benchmarks/reliability.json` records them,
and `--table` writes this page from the record. A run of
fewer tries than the whole attack says its share.

| attack | what it does | tries | what was counted | broken |
|---|---|---|---|---|
"""
_DETAILS = ("tries", "seed", "seconds", "share")


def write(record: Mapping[str, Mapping[str, Any]], about: Mapping[str, str]) -> None:
    """Write the document; `about` has a sentence for each attack, recorded or not."""
    DOCUMENT.write_text(
        _HEAD + "".join(_row(name, record, about) for name in about) + _runs(record)
    )


def _row(name: str, record: Mapping[str, Mapping[str, Any]], about: Mapping[str, str]) -> str:
    if name not in record:
        return f"| {name} | {about[name]} | not recorded | | |\n"
    result = record[name]
    counted = ", ".join(
        f"{key.replace('_', ' ')} {value}"
        for key, value in result.items()
        if isinstance(value, int) and key not in _DETAILS
    )
    tries, share = f"{result['tries']:,}", result["share"]
    if share < 1:
        tries = f"{tries} ({share:.1%} of the attack)"
    return f"| {name} | {about[name]} | {tries} | {counted} | {len(result['failures'])} |\n"


def _runs(record: Mapping[str, Mapping[str, Any]]) -> str:
    """When and where each attack was run."""
    lines = [
        "\n| attack | date | machine | versions | commit | seconds |\n|---|---|---|---|---|---|\n"
    ]
    for name, result in record.items():
        versions = ", ".join(f"{key} {value}" for key, value in result.get("versions", {}).items())
        place = f"{result['date']} | {result['machine']} | {versions}"
        lines.append(f"| {name} | {place} | {result['commit']} | {result['seconds']} |\n")
    return "".join(lines)
