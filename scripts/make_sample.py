# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a sample file to look into: python3 scripts/make_sample.py.

Twenty named strokes, most of them mirrored, turn Suzanne's head into an idol; a second field, an
egg with a band, lies beside it; a mask protects the ears. Writes demo/sample.blend, and
docs/strokes.jpg, the head before and after its strokes.
"""

import sys

from workshop import ROOT, environment

SAMPLE = ROOT / "demo" / "sample.blend"
PICTURE = ROOT / "docs" / "strokes.jpg"


def main() -> None:
    """Sculpt, save, render."""
    if sys.argv[1:]:
        sys.exit(__doc__)
    environment.enter("blender")
    from in_blender import sample

    SAMPLE.parent.mkdir(exist_ok=True)
    sample.make(SAMPLE, PICTURE)
    for path in (SAMPLE, PICTURE):
        print(f"{path.relative_to(ROOT)}, {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
