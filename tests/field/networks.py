# SPDX-License-Identifier: GPL-3.0-or-later
"""Networks of real shapes: the packed ones, and pretrained ones where they lie beside the project.

The packed ones are made by scripts/make_test_networks.py.
"""

from pathlib import Path

from neural_sculpt_addon.field.checkpoint import load

PACKED = Path(__file__).parent / "packed"
DATA = Path(__file__).parents[2].parent / "shared/data"
FILES = {
    path.stem: path
    for folder in (PACKED, DATA / "networks")
    for path in sorted(folder.glob("*.pth"))
}
MODELS = (*FILES,)


def network_of(model):
    """The field of this name."""
    return load(FILES[model])
