# SPDX-License-Identifier: GPL-3.0-or-later
"""How a process ended, in words. Standard library only."""

import signal


def exit_in_words(code: int, log_tail: str = "") -> str:
    """A return code in words: the exception that Python ended with, or the signal it died of."""
    if code >= 0:
        last = log_tail.rpartition("\n")[2].strip()
        return f"exit code {code}: {last}" if code and last else f"exit code {code}"
    try:
        return f"killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"killed by signal {-code}"
