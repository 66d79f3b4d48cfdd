# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset files: what is written is read again, and nothing else is believed."""

import json

import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.interaction.preset_file import BUILT_IN, Preset, dump_preset, parse_preset

GEM = Preset(
    "profile", "Für Élise", ((-1.0, 0.0), (-0.25, 1.0), (0.5, -0.5), (1.0, 0.0)), ("VECTOR",) * 4
)


def changed(**fields):
    return json.dumps(json.loads(dump_preset(GEM)) | fields)


@pytest.mark.parametrize("preset", [GEM, *BUILT_IN], ids=lambda preset: preset.name)
def test_what_is_written_is_read(preset):
    assert parse_preset(dump_preset(preset)) == preset


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "[" * 100_000,
        " " * 70_000,
        changed(version=2),
        changed(kind="brush"),
        changed(name=""),
        changed(name="a\nb"),
        changed(name="n" * 49),
        changed(more=1),
        changed(points=[[-1, 0]]),
        changed(points=[[-1, 0], [1, True], [2, 3], [4, 5]]),
        changed(points=[[-1, 0], [-1, 0], [0, 0], [1, 0]]),
        changed(points=[[-1, 0], [0, 5], [0.5, 0], [1, 0]]),
        changed(points=[[-1, 0], [0, float("nan")], [0.5, 0], [1, 0]]),
        changed(points={"a": 1}),
        changed(handles=["AUTO"] * 3),
        changed(handles=["ALIGNED"] * 4),
        changed(handles=4),
    ],
    ids=lambda text: text[-40:].strip() or "blank",
)
def test_others_are_refused(text):
    with pytest.raises(SculptError):
        parse_preset(text)
