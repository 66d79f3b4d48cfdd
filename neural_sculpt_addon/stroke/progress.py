# SPDX-License-Identifier: GPL-3.0-or-later
"""How long work reports how far it is, and learns that it is no longer wanted."""

from collections.abc import Callable

Progress = Callable[[float, str], None]
"""Called with a fraction in [0, 1] and a short text; raises Cancelled when the work must stop."""


Check = Callable[[], None]
"""Called between short pieces of work; raises Cancelled when the work must stop."""


def silent(fraction: float, message: str) -> None:
    """Progress that nobody watches and nobody cancels."""


def go_on() -> None:
    """Check of work that nobody cancels."""


def sub_progress(progress: Progress, start: float, end: float) -> Progress:
    """Progress of the part from `start` to `end` of the whole."""
    return lambda fraction, message: progress(start + (end - start) * fraction, message)


def rising(progress: Progress) -> Progress:
    """Progress that never goes back: what is behind the latest news repeats it."""
    latest = 0.0, ""

    def tell(fraction: float, message: str) -> None:
        nonlocal latest
        if fraction >= latest[0]:
            latest = fraction, message
        progress(*latest)

    return tell
