# SPDX-License-Identifier: GPL-3.0-or-later
"""Replays give what the strokes give one by one, and repeat nothing that is remembered."""

import numpy as np
import pytest
import torch

from neural_sculpt_addon.field.checkpoint import to_bytes
from neural_sculpt_addon.field.edit import edit
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.errors import SculptError
from neural_sculpt_addon.stroke.stroke import Stroke
from neural_sculpt_addon.worker.replay import EDITS, Replays

CPU = torch.device("cpu")

BASE = primitive("sphere")
STATES = ["base", "one", "two"]


def dab(*point: float, radius: float = 0.1, name: str = "") -> Stroke:
    return Stroke(np.array([point]), Brush(radius, 0.05), name=name)


STROKES = [dab(0, 0, 0.6), dab(0.6, 0, 0, name="Ear")]


class Heard:
    """Listens to progress."""

    def __init__(self) -> None:
        self.messages: list[str] = []

    def __call__(self, fraction: float, message: str) -> None:
        assert 0 <= fraction <= 1
        self.messages.append(message)


def run(replays: Replays, strokes: list[Stroke], states: list[str]) -> tuple[bytes, set[str]]:
    """The resulting field, and which strokes were worked on."""
    heard = Heard()
    result = replays.run(to_bytes(BASE), strokes, states, "quick", heard)
    worked = {message.partition(":")[0] for message in heard.messages if "Stroke" in message}
    return to_bytes(result.network), worked


def test_a_replay_is_the_strokes_one_by_one_and_nothing_is_done_twice() -> None:
    replays = Replays(CPU)
    together = to_bytes(edit(BASE, STROKES, solver="quick").network)
    assert run(replays, STROKES, STATES) == (together, {"Stroke 1 of 2", "Stroke 2 of 2"})
    assert run(replays, STROKES, STATES) == (together, set())
    other = dab(0.6, 0, 0, radius=0.2)
    changed, worked = run(replays, [STROKES[0], other], ["base", "one", "two'"])
    assert worked == {"Stroke 2 of 2"}
    assert changed != together
    assert run(replays, [], ["base"]) == (to_bytes(BASE), set())


def test_a_drawn_stroke_needs_no_replay() -> None:
    replays = Replays(CPU)
    drawn = edit(BASE, STROKES[:1], solver="quick")
    replays.remember("one", drawn)
    assert run(replays, STROKES[:1], STATES[:2]) == (to_bytes(drawn.network), set())


def test_the_stroke_that_cannot_be_placed_is_named() -> None:
    with pytest.raises(SculptError, match=r"^Ear: "):
        run(Replays(CPU), [dab(0, 0, 0.6), dab(0.9, 0, 0, radius=0.02, name="Ear")], STATES)


def test_names_must_fit_the_strokes() -> None:
    with pytest.raises(SculptError, match="state"):
        run(Replays(CPU), STROKES, ["base"])


def test_old_states_are_forgotten() -> None:
    replays = Replays(CPU)
    made = edit(BASE, [])
    for number in range(2 * EDITS):
        replays.remember(str(number), made)
    assert len(replays._edits) == EDITS
