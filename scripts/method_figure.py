# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of docs/method.md: python3 scripts/method_figure.py [supports] [refinement]."""

import argparse

from pictures import refinement, supports
from workshop import ROOT, environment

PICTURES = {"supports": supports, "refinement": refinement}


def main() -> None:
    """Write those that are named, or both."""
    parser = argparse.ArgumentParser(description="The pictures of docs/method.md.")
    parser.add_argument("names", nargs="*", choices=[*PICTURES, []], metavar="NAME")
    names = parser.parse_args().names
    environment.enter("worker")
    for name in names or PICTURES:
        PICTURES[name].write()
        print(PICTURES[name].TARGET.relative_to(ROOT), flush=True)


if __name__ == "__main__":
    main()
