# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine, the versions and the seeds of a run."""

import os
import platform
import tomllib
from importlib.metadata import version
from pathlib import Path
from typing import Any

from workshop import ROOT

from .settings import Settings

MANIFEST = ROOT / "blender_manifest.toml"
LIBRARIES = ("torch", "numpy", "scipy", "trimesh", "libigl")


def about(settings: Settings) -> dict[str, Any]:
    """All of it, ready for JSON."""
    return {
        "version": tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"],
        "processor": processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        **{name: version(name) for name in LIBRARIES},
        "settings": settings.to_json(),
    }


def told(facts: dict[str, Any]) -> str:
    """The same as a paragraph."""
    versions = ", ".join(f"{name} {facts[name]}" for name in LIBRARIES)
    return (
        f"Neural Sculpt {facts['version']}; {facts['processor']}, {facts['cores']} cores, no"
        f" graphics card; {facts['system']}, Python {facts['python']}, {versions};"
        f" seed {facts['settings']['seed']}."
    )


def processor() -> str:
    """Its name, as the system tells it."""
    path = Path("/proc/cpuinfo")
    if path.is_file():
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
