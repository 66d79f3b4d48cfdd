# SPDX-License-Identifier: GPL-3.0-or-later
"""Orders by a person who goes on without waiting for results, whatever the worker does meanwhile.

Some strokes are in the field, others are on the mesh or are shown as previews, and wait for their
results. To the artist all of them are there: each press of Ctrl Z takes back one of them or a
change of the mode, and each of Shift Ctrl Z brings it back. When all have come in, a state of the
field is the same whichever way led to it.
"""

from collections.abc import Callable
from typing import Any

import bpy
from drawing import SECONDS, choose_native_brush, choose_tool, edited, field
from hands import PersonHands, draw, drawing
from harness import module, vertices
from in_blender import simulated_input as hand
from in_blender.simulated_input import Steps
from undo_orders import Order, differ, is_close

LENGTH = 20  # words, ahead of the way back and forth
PAUSES = 0.1, 0.3, 0.6, 1.5, 3.0  # seconds

proxies = module("blender.session.absorption.tracked_proxies").proxies
STRETCHED = module("blender.scene.mesh.proxy_mesh").STRETCHED


class HastyHands(PersonHands):
    """How such a person does what is in an order, and what the worker does meanwhile."""

    stopped = False
    """Whether the worker does nothing."""

    def native(self) -> Steps:
        yield from self.stroke(choose_native_brush)

    def neural(self) -> Steps:
        yield from self.stroke(choose_tool)

    def stroke(self, choose: Callable[[], None]) -> Steps:
        choose()
        yield hand.DRAWN
        count = self.strokes()
        yield from draw(self.path())

        def drawn() -> bool:
            return self.strokes() > count and not hand.window().modal_operators

        yield from hand.until(drawn, SECONDS, "a stroke that is there")

    def undone_at_once(self) -> Steps:
        """A native stroke, which is undone before anything can have looked at it."""
        choose_native_brush()
        yield hand.DRAWN
        words = drawing(self.path())
        yield from self.step(bpy.app.handlers.undo_post, *words, "key", "ctrl+z")

    def pause(self) -> Steps:
        yield self.random.choice(PAUSES)

    def stop(self) -> Steps:
        """From now on the worker does nothing."""
        self.case.stop_worker()
        self.stopped = True
        yield hand.DRAWN

    def go(self) -> Steps:
        """It goes on."""
        self.case.go_on()
        self.stopped = False
        yield hand.DRAWN

    def settle(self) -> Steps:
        """All comes into the field, but for what would cut off what can be redone."""
        session = self.case.session
        if self.stopped:
            yield from self.go()

        def rests() -> bool:
            return session.rests and (bool(session.jobs) or session.behind is None)

        for _ in range(2):
            yield from hand.until(rests, SECONDS, "a rest")
            yield 2 * hand.DRAWN
        self.case.assertEqual(session.last_error, "")

    def strokes(self) -> int:
        """How many the artist sees: in the field, and on their way into it."""
        ob, jobs = field(), self.case.session.jobs
        proxy = proxies.get(ob.session_uid)
        brushed = 0 if proxy is None else len(proxy.strokes)
        return len(ob.neural_sculpt.strokes) + brushed + sum(bool(job.strokes) for job in jobs)


class HastyOrder(Order):
    """Such an order. Neural strokes come in behind what was done while they were computed, so undo
    may take back the one or the other; but each press is about one thing. Wherever all has come
    into the field, it and its mesh are as they were in that state before, byte for byte."""

    def __init__(self, seed: str, hands: HastyHands, name: str) -> None:
        super().__init__(seed, hands, name)
        self.hasty = hands
        self.last = 0
        """Things that are done, and those that can be redone."""
        self.meshes: dict[str, bytes] = {}
        """By revision of the field."""

    def play(self) -> Steps:
        """All of it; then all the way forth, back and forth again, where everything settles."""
        yield from self.do("toggle_mode")
        while len(self.told) < LENGTH:
            yield from self.do(self.random.choice(self.choices()))
        yield from self.do("settle")
        while self.at < self.last:
            yield from self.do("redo")
            yield from self.do("settle")
        settled = [self.look()]
        while self.at > 0:
            yield from self.do("undo")
            yield from self.do("settle")
            settled.append(self.look())
        self.compare(settled.pop(), self.states[0])
        while settled:
            yield from self.do("redo")
            yield from self.do("settle")
            self.compare(self.look(), settled.pop())

    def choices(self) -> list[str]:
        """What can be done now."""
        words = ["toggle_mode", "pause", "settle", *["neural"] * 4]
        words += ["go"] * 2 if self.hasty.stopped else ["stop"]
        words += [*["native"] * 4, "undone_at_once"] * (field().mode == "SCULPT")
        return words + ["undo"] * 5 * (self.at > 0) + ["redo"] * 5 * (self.at < self.last)

    def do(self, word: str) -> Steps:
        """One thing, or something of the worker's, and what must be so after it."""
        self.told.append(word)
        strokes, mode = before = self.seen()
        yield from getattr(self.hands, word)()
        other = strokes, "OBJECT" if mode == "SCULPT" else "SCULPT"
        more, fewer = (strokes + 1, mode), (strokes - 1, mode)
        if word in ("undo", "redo"):
            self.at += -1 if word == "undo" else 1
            expected = [fewer if word == "undo" else more, other]
        elif word in ("native", "neural", "toggle_mode"):
            self.at += 1
            self.last = self.at
            expected = [other if word == "toggle_mode" else more]
        else:
            self.last = self.at + 1 if word == "undone_at_once" else self.last
            expected = [before]
        self.be(self.seen() in expected, f"{before} has become {self.seen()}")
        self.check()

    def seen(self) -> tuple[int, str]:
        """How many strokes there are, and the mode."""
        return self.hasty.strokes(), field().mode

    def check(self) -> None:
        """Where all is in the field, the mesh is the one that this revision of the field had
        before, unless it is still to be renewed."""
        group, mesh = field().neural_sculpt, field().data
        if len(group.strokes) < self.hasty.strokes() or STRETCHED in mesh:
            return
        self.be(not edited(), "sculpted")
        now = vertices(field()).tobytes()
        self.be(is_close(now, self.meshes.setdefault(group.revision, now)), "another mesh")

    def compare(self, one: list[Any], two: list[Any]) -> None:
        """Two states are the same."""
        wrong = differ(one, two)
        self.be(not wrong, f"{', '.join(wrong)} not the same")

    def be(self, is_so: bool, why: str) -> None:
        """AssertionError unless something is so."""
        assert is_so, f"{why} at {self.at}, after {', '.join(self.told)}"
