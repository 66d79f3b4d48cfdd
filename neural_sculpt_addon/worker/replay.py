# SPDX-License-Identifier: GPL-3.0-or-later
"""Replays: the strokes of a history applied to its base weights, one after another.

What the first strokes made is remembered, so that a change of the last one need not repeat them.
Blender names each state: the same name always means the same base weights, solver and strokes.
"""

from collections import OrderedDict
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..stroke.errors import SculptError
from ..stroke.progress import Progress
from ..stroke.stroke import Stroke

if TYPE_CHECKING:
    import torch

    from ..field.edit import Edit

EDITS = 16
"""States that are remembered, some 10 MB each."""


class Replays:
    """The replays of one worker, and the strokes that need none because they were just drawn."""

    def __init__(self, device: "torch.device") -> None:
        """Nothing is known yet; `device` is what strokes are sculpted on."""
        self._device = device
        self._edits: OrderedDict[str, Edit] = OrderedDict()

    def run(
        self,
        base: bytes,
        strokes: Sequence[Stroke],
        states: Sequence[str],
        solver: str,
        progress: Progress,
    ) -> "Edit":
        """The edit of `base`, a field as of `field.checkpoint.to_bytes`, by all strokes.

        states: names of the state before all strokes, after the first, and so on

        Its reports end with that of the last stroke; there are none without strokes. SculptError
        that names the stroke which cannot be applied where it stands now.
        """
        from ..field.checkpoint import from_bytes
        from ..field.edit import edit

        if len(states) != len(strokes) + 1:
            raise SculptError("A replay needs the name of the state before and after each stroke.")
        done = next((n for n in reversed(range(len(states))) if states[n] in self._edits), None)
        if done is None:
            progress(0.0, "Preparing")
            done, last = 0, edit(from_bytes(base).to(self._device), [])
        else:
            last = self._edits[states[done]]
        self.remember(states[done], last)
        for number, stroke in enumerate(strokes[done:], done):

            def share(fraction: float, message: str, place: int = number) -> None:
                part = (place - done + fraction) / (len(strokes) - done)
                progress(part, f"Stroke {place + 1} of {len(strokes)}: {message}")

            try:
                last = edit(
                    last.network,
                    [stroke],
                    solver=solver,
                    preparation=last.preparation,
                    progress=share,
                )
            except SculptError as error:
                name = stroke.name or f"Stroke {number + 1}"
                raise SculptError(f"{name}: {error} Nothing was changed.") from error
            self.remember(states[number + 1], last)
        return last

    def remember(self, state: str, edit: "Edit") -> None:
        """What the strokes so far made."""
        self._edits[state] = edit
        self._edits.move_to_end(state)
        while len(self._edits) > EDITS:
            self._edits.popitem(last=False)
