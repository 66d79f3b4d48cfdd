# SPDX-License-Identifier: GPL-3.0-or-later
"""The workshop: what scripts and tests need of this computer. Standard library only.

    environment, virtualenv   `.venv/`, made on the first start
    blenders, screen          installed Blenders, and a virtual screen for their windows
    commands                  programs that run at the same time and end together
    parts, lanes, failures    of the test command: what runs, what runs beside it, and what failed

To import it makes the extension's package importable, too.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

if sys.version_info < (3, 11):  # noqa: UP036 - which a person has yet to learn
    sys.exit("Neural Sculpt needs Python 3.11 or 3.13; start this script with one of them.")
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))
