# SPDX-License-Identifier: GPL-3.0-or-later
"""Film Neural Sculpt in a real window: python3 scripts/tour.py.

Suzanne gets three strokes by hand, on a virtual screen. Writes docs/tour.webp, an animation, and
docs/window.jpg, the window at its end; and the file that was made as demo/tour.blend.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import build_extension
from in_blender import START
from workshop import ROOT, blenders, commands, environment, screen

ANIMATION, STILL = ROOT / "docs" / "tour.webp", ROOT / "docs" / "window.jpg"
SECONDS = 1800
SIZE = (1280, 1024)  # of the window: so high that the panels are in it
VIEW = (0, 28, 1050, 926)  # of the window that is filmed: the viewport
SMALLER = 0.62
FRAME, LAST = 130, 2500  # milliseconds


def main() -> None:
    """Film it and write the pictures."""
    argparse.ArgumentParser(description="Film Neural Sculpt in a real window.").parse_args()
    environment.enter("worker")
    if missing := screen.why_none():
        sys.exit(missing)
    workshop = environment.ensure()
    program = blenders.first(workshop)
    (ROOT / "demo").mkdir(exist_ok=True)
    with (
        tempfile.TemporaryDirectory() as frames,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as user,
        screen.virtual_screen(SIZE) as on_screen,
    ):
        variables = {**program.variables, **on_screen, "BLENDER_USER_RESOURCES": user}
        given = [str(build_extension.build(workshop)), frames, str(ROOT / "demo" / "tour.blend")]
        command = screen.window_command(program, START, ["in_blender.tour", *given], size=SIZE)
        code, _, _ = commands.run(command, variables, SECONDS)
        if code:
            sys.exit(code)
        _write(sorted(Path(frames).glob("*.png")))
    for path in (ANIMATION, STILL):
        print(f"{path.relative_to(ROOT)}, {path.stat().st_size / 1e3:.0f} kB")


def _write(frames: list[Path]) -> None:
    from PIL import Image

    pictures = [Image.open(path).convert("RGB") for path in frames]
    pictures[-1].save(STILL, quality=83)
    size = round((VIEW[2] - VIEW[0]) * SMALLER), round((VIEW[3] - VIEW[1]) * SMALLER)
    film = [p.crop(VIEW).resize(size, Image.Resampling.LANCZOS) for p in pictures]
    durations = [FRAME] * (len(film) - 1) + [LAST]
    film[0].save(
        ANIMATION,
        save_all=True,
        append_images=film[1:],
        duration=durations,
        loop=0,
        quality=40,
        method=4,
    )


if __name__ == "__main__":
    main()
