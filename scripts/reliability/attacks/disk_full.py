# SPDX-License-Identifier: GPL-3.0-or-later
"""No room on the disk in a stroke, a fit, an export and a save: nothing half-written, no loss.

Blender as a module with everything on a small disk of its own, which is really full. First it has
room for no page of 4096 bytes, then for one, and so on until all goes through, so that every write
which takes room fails once at each page that it takes. Then it gets full all at once, before the
worker's first message, its second, and so on. A stroke must be in the history, muted at worst; a
fit must add a field or say why not; an export and a save must leave the old file or a new one that
is whole.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from in_blender import START

from .. import disk

COUNT = 400  # about as many places as there are; the attack finds all
ROLE = "blender"


def run(count: int, seed: int, report: Callable[[str], None]) -> dict[str, Any]:
    """Every place, or as many of them as `count` is of COUNT; nothing here is left to chance."""
    step = max(1, round(COUNT / count))
    counted: dict[str, Any] = {}
    versions: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        blender = [sys.executable, str(START), "reliability.attacked.full_disk"]
        command = disk.command(Path(folder), *blender, folder, str(step))
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as blender:
            for line in blender.stdout or ():
                if line.startswith("version "):
                    versions["Blender"] = line.split()[1]
                elif line.startswith("{"):
                    counted = json.loads(line)
                    report(line.strip())
    failures = counted.pop("failures", [])
    if blender.returncode:
        failures.append(f"Blender, or the disk, ended with {blender.returncode}.")
    return {**counted, "versions": versions, "failures": failures}
