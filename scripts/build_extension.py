# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the extension as a zip in dist/: python3 scripts/build_extension.py.

The manifest, the licence and the contents of neural_sculpt_addon/ are staged in a folder of their
own, for the root of the archive must hold both the manifest and `__init__.py`. Blender's builder,
which comes with the bpy wheel, packs and validates it. The entries are then put in order, all with
the same time and mode, so the same sources give the same bytes. Standard library only.
"""

import argparse
import os
import shutil
import subprocess
import tempfile
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path

from workshop import ROOT, environment
from workshop.environment import Workshop

from neural_sculpt_addon.common.errors import SculptError

DIST = ROOT / "dist"
PACKAGE = ROOT / "neural_sculpt_addon"
MANIFEST = ROOT / "blender_manifest.toml"


def build(workshop: Workshop, folder: Path = DIST) -> Path:
    """Build and validate `folder`/ID-VERSION.zip. SculptError says what is wrong with it."""
    manifest = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))
    target = folder / f"{manifest['id']}-{manifest['version']}.zip"
    builder = [str(workshop.blender), "-I", str(_builder(workshop))]
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        stage, packed = Path(temporary) / "stage", Path(temporary) / target.name
        _stage(stage)
        source = ["--source-dir", str(stage), "--output-filepath", str(packed)]
        _run([*builder, "build", *source])
        arriving = target.with_suffix(f".{os.getpid()}.zip")
        _repack(packed, arriving)
        _run([*builder, "validate", str(arriving)])
        arriving.replace(target)
    return target


def _stage(folder: Path) -> None:
    """Copy what the extension holds; without what the repository leaves out."""
    ignore = shutil.ignore_patterns("__pycache__", "*.pyc", ".*")
    shutil.copytree(PACKAGE, folder, ignore=ignore)
    for path in (MANIFEST, ROOT / "LICENSE"):
        shutil.copyfile(path, folder / path.name)


def _repack(source: Path, target: Path) -> None:
    """Copy a zip with its entries in order and without times."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in sorted(old.namelist()):
            entry = zipfile.ZipInfo(name)
            entry.external_attr = 0o644 << 16
            new.writestr(entry, old.read(name), zipfile.ZIP_DEFLATED, compresslevel=9)


def _builder(workshop: Workshop) -> Path:
    """Blender's own builder, in the scripts of its module for Python."""
    find = "import importlib.util as u; print(u.find_spec('bpy').submodule_search_locations[0])"
    folder = Path(_run([str(workshop.blender), "-I", "-c", find]).strip())
    found = [*folder.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")]
    if not found:
        raise SculptError("Blender's extension builder is not in .venv; remove .venv, start again.")
    return found[0]


def _run(command: Sequence[str]) -> str:
    """What a command prints; SculptError, with the same, when it fails."""
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if ran.returncode:
        raise SculptError(f"The extension cannot be built: {ran.stdout}{ran.stderr}")
    return ran.stdout


def main() -> None:
    """Build the extension and say where it is."""
    argparse.ArgumentParser(description="Build the extension as a zip in dist/.").parse_args()
    try:
        path = build(environment.ensure_or_exit())
    except SculptError as error:
        raise SystemExit(str(error)) from error
    print(f"{path.relative_to(ROOT)}, {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
