# SPDX-License-Identifier: GPL-3.0-or-later
"""See Neural Sculpt at work: python3 scripts/demo.py.

Suzanne becomes a neural field, two strokes sculpt it through the real worker process, and demo/
gets before.png, after.png, sculpted.blend and sculpted.obj. Everything goes through the operators
that an artist uses.

    --mesh FILE.obj        a mesh of your own instead (.obj, .ply, .stl)
    --network FILE.pth     a network of your own instead (.pth, .safetensors)
    --strokes FILE.json    your own strokes, in model space, instead of those the demo draws
"""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from workshop import ROOT, environment

OUTPUT = ROOT / "demo"
MESHES = (".obj", ".ply", ".stl")
NETWORKS = (".pth", ".safetensors")


def main() -> None:
    """Check the command line, enter the environment, sculpt, and write the pictures and files."""
    options = _options()
    environment.enter("blender")
    from in_blender.demo import sculpt

    try:
        sculpt(OUTPUT, options.mesh, options.network, options.strokes)
    except RuntimeError as error:  # what an operator reports
        sys.exit(f"\n{str(error).strip().removeprefix('Error: ')}")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="See Neural Sculpt at work; results go to demo/.")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--mesh", type=_file(*MESHES), help="your mesh: .obj, .ply or .stl")
    source.add_argument("--network", type=_file(*NETWORKS), help="your network")
    parser.add_argument("--strokes", type=_file(".json"), help="your strokes, in model space")
    return parser.parse_args()


def _file(*suffixes: str) -> Callable[[str], Path]:
    """An argument type: a file that is there and has one of the suffixes."""

    def check(text: str) -> Path:
        path = Path(text).resolve()
        if not path.is_file():
            raise argparse.ArgumentTypeError(f"there is no file {text}")
        if path.suffix.lower() not in suffixes:
            raise argparse.ArgumentTypeError(f"{text} is none of {', '.join(suffixes)}")
        return path

    return check


if __name__ == "__main__":
    main()
