# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m neural_sculpt_addon`: see cli."""

import sys

from .cli import main
from .worker.settings import settle

settle()
sys.exit(main())
