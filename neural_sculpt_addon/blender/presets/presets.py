# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's own presets of the curve widgets: files in the preset folder.

The stem of a file identifies its preset, so files may be copied there by hand.
"""

import logging
import os
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

import bpy

from ...common.errors import SculptError
from ...interaction.preset_file import LARGEST_FILE, Preset, dump_preset, parse_preset
from ..folders import preset_folder

log = logging.getLogger(__name__)

SUFFIX = ".json"
MOST_FILES = 256


def own(kind: str) -> dict[str, Preset]:
    """The artist's presets by the stem of their file; read once, and again after `refresh`."""
    return {stem: preset for stem, preset in _own() if preset.kind == kind}


def refresh() -> None:
    """Files have changed."""
    _own.cache_clear()


def save(preset: Preset) -> str:
    """Write a preset of the artist and return its stem; one of the same name is replaced, whole or
    not at all."""
    stem, known = bpy.path.clean_name(f"{preset.kind}-{preset.name}").lower(), own(preset.kind)
    while stem in known and known[stem].name != preset.name:
        stem += "_"
    path = preset_folder() / (stem + SUFFIX)
    part = path.with_suffix(".part")
    try:
        preset_folder().mkdir(parents=True, exist_ok=True)
        part.write_text(dump_preset(preset), encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise SculptError("The preset was not written ({}). Free some space.", error) from error
    refresh()
    return stem


def refuse_taken(preset: Preset, stem: str = "") -> None:
    """SculptError when another preset of the artist has this name.

    stem: of the one that may have it
    """
    others = (other for known, other in own(preset.kind).items() if known != stem)
    if any(other.name == preset.name and other != preset for other in others):
        raise SculptError(
            "There is already a preset {}. Rename or delete that one first.", preset.name
        )


def delete(stem: str) -> None:
    """Delete a preset of the artist."""
    try:
        (preset_folder() / (stem + SUFFIX)).unlink(missing_ok=True)
    except OSError as error:
        raise SculptError("The preset was not deleted ({}). Delete it by hand.", error) from error
    refresh()


def read(path: Path) -> Preset:
    """The preset in a file. SculptError when it is none."""
    try:
        with path.open("rb") as file:
            return parse_preset(file.read(LARGEST_FILE + 1).decode("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise SculptError(
            "{} cannot be read ({}). Choose another file.", path.name, error
        ) from error


@cache
def _own() -> tuple[tuple[str, Preset], ...]:
    return tuple(_read_folder())


def _read_folder() -> Iterator[tuple[str, Preset]]:
    for path in sorted(preset_folder().glob(f"*{SUFFIX}"))[:MOST_FILES]:
        try:
            yield path.stem, read(path)
        except SculptError as error:
            log.warning("%s: %s", path.name, error)
