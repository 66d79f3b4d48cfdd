# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts import each other as they do when one of them is started: from their own folder."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "scripts"))
