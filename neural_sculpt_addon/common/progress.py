# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress and cancel: how long work reports its progress and hears that it was cancelled."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Progress = Callable[[float, str], None]
"""Called with a fraction in [0, 1] and a short text; raises Cancelled when the work must stop."""


Check = Callable[[], None]
"""Called between short pieces of work; raises Cancelled when the work must stop."""


def silent(fraction: float, message: str) -> None:
    """Progress that nobody watches and nobody cancels."""


def go_on() -> None:
    """Check of work that nobody cancels."""


_interruption: ContextVar[Check] = ContextVar("interruption", default=go_on)


@contextmanager
def interruptible(check: Check) -> Iterator[None]:
    """Work within which `look` calls `check`, on any thread."""
    token = _interruption.set(check)
    try:
        yield
    finally:
        _interruption.reset(token)


def look() -> None:
    """Check of work that is given none, deep within other work, as that of `interruptible`."""
    _interruption.get()()


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
