# SPDX-License-Identifier: GPL-3.0-or-later
"""Attack the product and count what breaks: python3 scripts/stress.py [--only NAME ...].

Each attack is a module of `reliability.attacks`. Its docstring says in its first line what it does,
and it has

    COUNT    tries of the whole attack
    ROLE     the Python it needs: "worker", with torch, or "blender", with bpy
    run(count, seed, report) -> counts by name, and `failures`, a list of sentences

where report(text) shows how far it is. Modules import NumPy, torch and bpy within their functions.
Each attack runs in a process of its own; one that crashes it has failed. The exit code is 1 when
anything failed. `--table` writes docs/reliability.md from what `--json` recorded.
"""

import argparse
import importlib
import json
import os
import pkgutil
import platform
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import Any

from reliability import attacks, document
from workshop import ROOT, environment

from neural_sculpt_addon.common.child import exit_in_words
from neural_sculpt_addon.worker.install.environment import ENVIRONMENT_VARIABLE

ATTACKS = tuple(module.name for module in pkgutil.iter_modules(attacks.__path__))
RECORD = ROOT / "benchmarks" / "reliability.json"
LONGEST = 4 * 3600  # seconds of one attack
FAILURES_SHOWN = 10


def attack(name: str) -> ModuleType:
    """The module of an attack."""
    return importlib.import_module(f"{attacks.__name__}.{name}")


def run(name: str, count: int, seed: int) -> dict[str, Any]:
    """One attack in a process of its own: what it counted, its failures, seconds, versions."""
    workshop = environment.ensure_or_exit()
    python = getattr(workshop, attack(name).ROLE)
    variables = {**os.environ, ENVIRONMENT_VARIABLE: str(workshop.worker)}
    started = time.monotonic()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        answer = Path(folder) / "answer.json"
        within = ["--within", str(answer), "--only", name]
        command = [str(python), __file__, *within, "--tries", str(count), "--seed", str(seed)]
        try:
            code = subprocess.run(command, env=variables, timeout=LONGEST, check=False).returncode
            ended = exit_in_words(code)
        except subprocess.TimeoutExpired:
            ended = f"ended after {LONGEST} s"
        if answer.exists():
            result = json.loads(answer.read_text())
        else:
            result = {"failures": [f"The attack's own process did not finish: {ended}."]}
    return {"tries": count, **result, "seconds": round(time.monotonic() - started)}


def within(name: str, count: int, seed: int, answer: Path) -> None:
    """The same in this process, which has the Python that the attack needs."""
    result = attack(name).run(count, seed, lambda text: print(f"  {text}", flush=True))
    answer.write_text(json.dumps({"versions": _versions()} | result, allow_nan=False))


def _versions() -> dict[str, str]:
    """Of what is in this process."""
    found = {"Python": platform.python_version()}
    for package in ("numpy", "torch"):
        if package in sys.modules:
            found[package] = sys.modules[package].__version__
    if "bpy" in sys.modules:
        found["Blender"] = sys.modules["bpy"].app.version_string
    return found


def _about(seed: int) -> dict[str, Any]:
    """When, where and of what a record is."""
    git = ["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(git, capture_output=True, text=True, check=False).stdout.strip()
    machine = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    date = datetime.now(UTC).date().isoformat()
    return {"date": date, "machine": machine, "commit": commit, "seed": seed}


def _record(path: Path, name: str, result: dict[str, Any]) -> None:
    """Put a result beside those of other attacks."""
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    known[name] = result
    text = json.dumps(dict(sorted(known.items())), indent=1)
    path.write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Run the attacks that the command line names; the exit code is 1 if one broke something."""
    parser = argparse.ArgumentParser(description="Attack the product and count what breaks.")
    parser.add_argument("--only", nargs="+", choices=ATTACKS, default=ATTACKS, metavar="NAME")
    parser.add_argument("--share", type=float, default=1.0, help="of the tries; default: all")
    parser.add_argument("--seed", type=int, default=1, help="default: %(default)s")
    parser.add_argument("--json", type=Path, help="record the results here, attack by attack")
    parser.add_argument("--table", action="store_true", help="only write docs/reliability.md")
    parser.add_argument("--tries", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--within", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.within:
        within(options.only[0], options.tries, options.seed, options.within)
        sys.stdout.flush()
        os._exit(0)  # some Blenders hang in a regular exit of their Python module
    if options.table:
        about = {name: (attack(name).__doc__ or "").splitlines()[0] for name in ATTACKS}
        document.write(json.loads((options.json or RECORD).read_text(encoding="utf-8")), about)
        return
    failed = False
    for name in options.only:
        count = max(1, round(options.share * attack(name).COUNT))
        result = run(name, count, options.seed)
        failures = result["failures"]
        failed = failed or bool(failures)
        numbers = ", ".join(f"{key} {n}" for key, n in result.items() if isinstance(n, int))
        print(f"{name}: {numbers}, failures {len(failures)}", flush=True)
        for failure in failures[:FAILURES_SHOWN]:
            print(f"  {failure}", flush=True)
        if options.json:
            about = {**_about(options.seed), "share": options.share}
            _record(options.json, name, about | result)
    sys.exit(int(failed))


if __name__ == "__main__":
    main()
