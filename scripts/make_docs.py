# SPDX-License-Identifier: GPL-3.0-or-later
"""Join the demo's two pictures into the one of the README: python3 scripts/make_docs.py.

Run scripts/demo.py first.
"""

import sys

from workshop import ROOT, environment

PICTURES = [ROOT / "demo" / name for name in ("before.png", "after.png")]
TARGET = ROOT / "docs" / "demo.jpg"
HEIGHT = 420


def main() -> None:
    """Write docs/demo.jpg."""
    environment.enter("worker")
    from PIL import Image

    if not all(path.exists() for path in PICTURES):
        sys.exit("demo/ has no pictures yet; run scripts/demo.py first.")
    pictures = [Image.open(path).convert("RGB") for path in PICTURES]
    pictures = [p.resize((p.width * HEIGHT // p.height, HEIGHT)) for p in pictures]
    joined = Image.new("RGB", (sum(p.width for p in pictures), HEIGHT))
    for number, picture in enumerate(pictures):
        joined.paste(picture, (number * picture.width, 0))
    TARGET.parent.mkdir(exist_ok=True)
    joined.save(TARGET, quality=85)
    print(TARGET.relative_to(ROOT))


if __name__ == "__main__":
    main()
