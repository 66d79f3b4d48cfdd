# SPDX-License-Identifier: GPL-3.0-or-later
"""Replays: the strokes of a history applied to its base weights, one after another.

What the first strokes made is remembered, so that a change of the last one need not repeat them. A
state is named by a hash of the base weights, the solver and the strokes that led to it.
"""

import hashlib
import json
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..stroke.errors import SculptError
from ..stroke.progress import Progress
from ..stroke.stroke import Stroke

if TYPE_CHECKING:
    from ..field.edit import Edit

EDITS = 16
"""States that are remembered, some 10 MB each."""


class Replays:
    """The replays of one worker."""

    def __init__(self) -> None:
        """Nothing was replayed yet."""
        self._edits: OrderedDict[str, Edit] = OrderedDict()

    def run(
        self, base: bytes, strokes: Sequence[Stroke], solver: str, progress: Progress
    ) -> "Edit":
        """The edit of `base`, a field as of `field.checkpoint.to_bytes`, by all strokes.

        Its reports end with that of the last stroke; there are none without strokes. SculptError
        that names the stroke which cannot be applied where it stands now.
        """
        from ..field.checkpoint import from_bytes
        from ..field.edit import edit

        keys = [*state_keys(base, strokes, solver)]
        done = next((n for n in reversed(range(len(keys))) if keys[n] in self._edits), None)
        if done is None:
            progress(0.0, "Preparing")
            done, last = 0, edit(from_bytes(base), [])
        else:
            last = self._edits[keys[done]]
        self._remember(keys[done], last)
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
            self._remember(keys[number + 1], last)
        return last

    def _remember(self, key: str, edit: "Edit") -> None:
        self._edits[key] = edit
        self._edits.move_to_end(key)
        while len(self._edits) > EDITS:
            self._edits.popitem(last=False)


def state_keys(base: bytes, strokes: Sequence[Stroke], solver: str) -> Iterator[str]:
    """The names of the state before all strokes, after the first, and so on."""
    key = hashlib.sha256(solver.encode() + b"\0" + base).hexdigest()
    yield key
    for stroke in strokes:
        data = json.dumps(replace(stroke, name="").to_json(), sort_keys=True)
        key = hashlib.sha256(f"{key}{data}".encode()).hexdigest()
        yield key
