# SPDX-License-Identifier: GPL-3.0-or-later
"""Replays of strokes that change the network, one after another: they have no layers.

What each stroke made of which field is remembered, so that a change of the last one need not repeat
the others.
"""

from collections.abc import Callable, MutableMapping, Sequence
from typing import TYPE_CHECKING

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, sub_progress
from ..stroke.stroke import Stroke

if TYPE_CHECKING:
    from ..field.edit import Edit
    from ..field.layers import State

Results = MutableMapping[str, "State"]
"""What strokes made of fields, by `result_key`."""


def replay_network(
    base: str,
    start: "Callable[[Progress], State]",
    strokes: Sequence[Stroke],
    results: Results,
    after: "Callable[[Edit], State]",
    solver: str,
    progress: Progress,
) -> "State":
    """The state after all `strokes`.

    base, start: id of the field before, and what makes its state
    after:       the state that an edit leads to

    SculptError that names the stroke which cannot be applied where it stands now.
    """
    from ..field.edit import sculpt

    done, state = 0, None
    while done < len(strokes) and result_key(base, strokes[done], solver) in results:
        state = results[result_key(base, strokes[done], solver)]
        base, done = state.base, done + 1
    if state is None:
        state = start(progress)
    for number, stroke in enumerate(strokes[done:], done):

        def share(fraction: float, message: str, number: int = number) -> None:
            part = (number - done + fraction) / (len(strokes) - done)
            progress(part, f"Stroke {number + 1} of {len(strokes)}: {message}")

        try:
            edit = sculpt(state.preparation, stroke, solver=solver, progress=share)
        except SculptError as error:
            name = stroke.name or f"Stroke {number + 1}"
            raise SculptError(f"{name}: {error} Nothing was changed.") from error
        key, state = result_key(state.base, stroke, solver), after(edit)
        results[key] = state
    return state


def result_key(base: str, stroke: Stroke, solver: str) -> str:
    """The name of what a stroke makes of a field."""
    from ..field.layers import digest, stroke_key

    return digest(f"{base} {solver} {stroke_key(stroke)}".encode())
