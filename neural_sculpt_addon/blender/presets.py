# SPDX-License-Identifier: GPL-3.0-or-later
"""The presets of the curve widgets: those that come with the extension, and the artist's own.

An artist's preset is a file in the preset folder; its stem identifies it, so files may be copied
there by hand. A preset is loaded into the widget, and what the widget shows is what the brush has.
"""

import logging
from collections.abc import Iterator
from pathlib import Path

import bpy

from ..stroke.errors import SculptError
from . import curve_store
from .built_in_presets import MODULATIONS, PROFILES
from .folders import preset_folder
from .preset_file import LARGEST_FILE, Preset, dump_preset, parse_preset

log = logging.getLogger(__name__)

SUFFIX = ".json"
MOST_FILES = 256

_own: dict[str, Preset] | None = None
_edition = 0


def built_in(kind: str) -> dict[str, Preset]:
    """The presets that come with the extension, by identifier."""
    presets = PROFILES if kind == curve_store.PROFILE else MODULATIONS
    return {preset.name.upper(): preset for preset in presets}


def own(kind: str) -> dict[str, Preset]:
    """The artist's presets by the stem of their file; read once, and again after `refresh`."""
    global _own  # noqa: PLW0603 - one folder, one list of what is in it
    if _own is None:
        _own = dict(_read_folder())
    return {stem: preset for stem, preset in _own.items() if preset.kind == kind}


def edition() -> int:
    """A number that changes with the presets."""
    return _edition


def refresh() -> None:
    """Files have changed."""
    global _own, _edition  # noqa: PLW0603
    _own = None
    _edition += 1


def load(preset: Preset) -> None:
    """Show a preset in its widget."""
    curve_store.set_curve(preset.kind, preset.points, preset.handles)


def save(preset: Preset) -> str:
    """Write a preset of the artist and return its stem; one of the same stem is replaced."""
    stem = bpy.path.clean_name(f"{preset.kind}-{preset.name}").lower()
    try:
        preset_folder().mkdir(parents=True, exist_ok=True)
        (preset_folder() / (stem + SUFFIX)).write_text(dump_preset(preset), encoding="utf-8")
    except OSError as error:
        raise SculptError(f"The preset was not written ({error}). Free some space.") from error
    refresh()
    return stem


def delete(stem: str) -> None:
    """Delete a preset of the artist."""
    try:
        (preset_folder() / (stem + SUFFIX)).unlink(missing_ok=True)
    except OSError as error:
        raise SculptError(f"The preset was not deleted ({error}). Delete it by hand.") from error
    refresh()


def read(path: Path) -> Preset:
    """The preset in a file. SculptError when it is none."""
    try:
        with path.open("rb") as file:
            return parse_preset(file.read(LARGEST_FILE + 1).decode("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise SculptError(f"{path.name} cannot be read ({error}). Choose another file.") from error


def _read_folder() -> Iterator[tuple[str, Preset]]:
    for path in sorted(preset_folder().glob(f"*{SUFFIX}"))[:MOST_FILES]:
        try:
            yield path.stem, read(path)
        except SculptError as error:
            log.warning("%s: %s", path.name, error)
