# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m neural_sculpt_addon`: see cli."""

import sys

from .cli import main
from .worker.runtime import set_up

set_up()
sys.exit(main())
