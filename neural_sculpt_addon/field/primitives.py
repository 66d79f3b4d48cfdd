# SPDX-License-Identifier: GPL-3.0-or-later
"""Ready fields to start from, fitted by scripts/make_primitives.py. Model space.

sphere   radius 0.6                      torus  radii 0.5 and 0.2, around z
box      1.2 x 1.2 x 1.2                 capsule  radius 0.35, from z = -0.4 to z = 0.4
suzanne  Blender's monkey, looking along -y, subdivided
"""

from pathlib import Path

from ..common.errors import SculptError
from .checkpoint import load
from .field import Field

PRIMITIVES = ("sphere", "torus", "box", "capsule", "suzanne")
FOLDER = Path(__file__).parent.parent / "primitives"


def primitive(name: str) -> Field:
    """The ready field called `name`. SculptError when there is none of that name."""
    if name not in PRIMITIVES:
        raise SculptError(
            "There is no primitive {}; there are {}.", f"{name!r:.100}", ", ".join(PRIMITIVES)
        )
    return load(FOLDER / f"{name}.safetensors")
