# SPDX-License-Identifier: GPL-3.0-or-later
"""The entry script for Blender: starts a module of scripts/, whose `main` gets the other arguments.

    blender --python scripts/in_blender/start.py -- in_blender.live EXTENSION.zip COUNT ROWS.json
    python scripts/in_blender/start.py in_blender.gallery MESH.ply       (a Python with bpy)

The module is named as it is imported.
"""

import importlib
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
importlib.import_module(given[0]).main(given[1:])
