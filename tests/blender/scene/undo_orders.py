# SPDX-License-Identifier: GPL-3.0-or-later
"""Random orders of native strokes, neural strokes, Absorb, modes, undo and redo on one field.

Each thing that the artist does is one press of Ctrl Z, which brings the state before it byte for
byte, and one of Shift Ctrl Z, which brings it back. An order is a generator, of which each
`yield seconds` lets a window be drawn.
"""

import random
from collections.abc import Generator
from typing import Any, Protocol

import bpy
import harness
import numpy as np

native_edits = harness.module("blender.scene.mesh.native_edits")

LENGTH = 14
BORDERS = [
    *("toggle_mode", "neural", "native", "absorb", "native", "native", "absorb", "neural"),
    *("neural", "toggle_mode"),
]
"""An order that has all kinds of steps beside each other."""
REPORT = 4  # in harness.state; it comes when it comes
MESH = 4  # in what an order looks at
ROUNDING = 0.0 if bpy.app.version >= (5, 0, 0) else 1e-8
"""Of what Blender's own brushes move, when Blender takes it back and brings it back."""
Steps = Generator[float, None, None]


class Hands(Protocol):
    """How an artist does things; each ends when the scene has what became of it."""

    def native(self) -> Steps: ...
    def neural(self) -> Steps: ...
    def absorb(self) -> Steps: ...
    def toggle_mode(self) -> Steps: ...
    def undo(self) -> Steps: ...
    def redo(self) -> Steps: ...


class Order:
    """An order; AssertionError where a state is not as it was; `told` is what was done."""

    def __init__(self, seed: str, hands: Hands, name: str = "Sphere") -> None:
        self.random, self.hands, self.name = random.Random(seed), hands, name
        self.told: list[str] = []
        self.states = [self.look()]
        self.at = 0

    def play(self) -> Steps:
        """All of it, and then all the way back and forth."""
        yield from self.do("toggle_mode")
        while len(self.told) < LENGTH:
            yield from self.do(self.random.choice(self.choices()))
        yield from self.back_and_forth()

    def play_borders(self) -> Steps:
        """Not a random one, but BORDERS."""
        for word in BORDERS:
            yield from self.do(word)
        yield from self.back_and_forth()

    def back_and_forth(self) -> Steps:
        """All the way back and all the way forth."""
        while self.at > 0:
            yield from self.do("undo")
        while self.at < len(self.states) - 1:
            yield from self.do("redo")

    def choices(self) -> list[str]:
        """What can be done now."""
        ob = harness.field(self.name)
        sculpting, edited = ob.mode == "SCULPT", native_edits.edited(ob)
        words = (
            ["toggle_mode"] + ["absorb" if edited else "neural"] * 4 + ["native"] * 3 * sculpting
        )
        words += ["undo"] * 3 * (self.at > 0)
        return words + ["redo"] * 2 * (self.at < len(self.states) - 1)

    def do(self, word: str) -> Steps:
        """One thing, and what must be so after it."""
        self.told.append(word)
        yield from getattr(self.hands, word)()
        if word in ("undo", "redo"):
            self.at += -1 if word == "undo" else 1
            self.check()
            return
        self.at += 1
        self.states[self.at :] = [self.look()]
        assert self.states[self.at] != self.states[self.at - 1], f"{word} did nothing"

    def look(self) -> list[Any]:
        """Everything that makes the field, and the mode."""
        ob = harness.field(self.name)
        seen = list(harness.state(ob))
        del seen[REPORT]
        return [*seen, ob.mode]

    def check(self) -> None:
        """The scene is as it was."""
        wrong = ", ".join(differ(self.look(), self.states[self.at]))
        assert not wrong, f"{wrong} not as at {self.at}, after {', '.join(self.told)}"


def differ(one: list[Any], two: list[Any]) -> list[str]:
    """What differs between two looks, by name."""
    names = "weights", "base", "strokes", "revision", "mesh", "place", "mode"
    same = [a == b for a, b in zip(one, two, strict=True)]
    same[MESH] = is_close(one[MESH], two[MESH])
    return [name for name, is_so in zip(names, same, strict=True) if not is_so]


def is_close(one: bytes, two: bytes) -> bool:
    """Whether vertices are the same but for ROUNDING."""
    if len(one) != len(two):
        return False
    return float(np.abs(np.frombuffer(one, "<f4") - np.frombuffer(two, "<f4")).max()) <= ROUNDING
