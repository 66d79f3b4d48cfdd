# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated input: a script inside Blender drives its window, and takes pictures of it.

A script is a generator that a timer steps: each `yield seconds` lets Blender's main loop run.
Mouse positions are window pixels from the lower left. Blender must have been started with
--enable-event-simulate, on a screen of `screen.virtual_screen`, which it fills.
"""

import os
import struct
import sys
import time
import traceback
import zlib
from collections.abc import Callable, Generator, Iterable, Sequence
from pathlib import Path
from typing import Any, cast

import bpy
import numpy as np
from bpy.types import Area, Region, RegionView3D, SpaceView3D, Window
from bpy_extras import view3d_utils
from mathutils import Quaternion
from numpy.typing import NDArray

Steps = Generator[float, None, None]
Pixel = tuple[float, float]
Held = Sequence[str]

SCREEN_FILE = "NEURAL_SCULPT_SCREEN"
DRAWN = 0.04  # seconds of the main loop, at whose end the window is drawn
ASKED = 0.02  # seconds after which is asked again whether something is so
RESTED = 0.005  # seconds of rest in each turn of the main loop
FRONT = Quaternion((0.7071068, 0.7071068, 0.0, 0.0))
TOP = Quaternion((1.0, 0.0, 0.0, 0.0))


def window() -> Window:
    """The one window; the context has none just after a file was loaded."""
    return bpy.context.window_manager.windows[0]


def event(kind: str, value: str, at: Pixel, held: Held, text: str = "") -> None:
    """Let Blender have one event: of a key or button pressed or released, or of the mouse."""
    x, y = map(int, at)
    given: Any = dict.fromkeys(held, True) | ({"unicode": text} if text else {})
    window().event_simulate(type=cast(Any, kind), value=cast(Any, value), x=x, y=y, **given)


def move(at: Pixel, held: Held = ()) -> None:
    """Move the mouse; `held` are "ctrl", "shift", "alt"."""
    event("MOUSEMOVE", "NOTHING", at, held)


def press(at: Pixel, held: Held = (), button: str = "LEFTMOUSE") -> None:
    """Press a button or a key and hold it."""
    event(button, "PRESS", at, held)


def release(at: Pixel, held: Held = (), button: str = "LEFTMOUSE") -> None:
    """Let go of a button or a key."""
    event(button, "RELEASE", at, held)


def tap(key: str, at: Pixel, held: Held = (), text: str = "") -> None:
    """Press a key, or click a button, and let go; `text` is what a key writes."""
    event(key, "PRESS", at, held, text)
    event(key, "RELEASE", at, held)


def drag(path: Iterable[Pixel], held: Held = (), pause: float = 0.0) -> Steps:
    """Drag with the left button through window points, all in one go or with a pause at each."""
    first, *others = path
    move(first, held)
    press(first, held)
    for point in others:
        if pause:
            yield pause
        move(point, held)
    release(others[-1], held)
    yield DRAWN


def until(condition: Callable[[], bool], seconds: float, what: str) -> Steps:
    """Let the main loop run until something is so. TimeoutError says what never was."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return
        yield ASKED
    raise TimeoutError(f"after {seconds:.0f} s there is still not: {what}")


def view_area() -> Area:
    """The largest 3D viewport."""
    areas = [area for area in window().screen.areas if area.type == "VIEW_3D"]
    return max(areas, key=lambda area: area.width * area.height)


def view() -> SpaceView3D:
    """What the largest 3D viewport shows."""
    space = view_area().spaces.active
    assert isinstance(space, SpaceView3D)
    return space


def region(kind: str = "WINDOW", area: Area | None = None) -> Region:
    """A region of the viewport, or of another area."""
    return next(r for r in (area or view_area()).regions if r.type == kind)


def look(rotation: Quaternion = FRONT, distance: float = 2.2) -> None:
    """Look at the origin along an axis, without perspective."""
    camera = _camera()
    camera.view_perspective = "ORTHO"
    camera.view_rotation, camera.view_distance = rotation, distance
    camera.view_location = (0, 0, 0)
    camera.update()


def show_tab(name: str) -> Steps:
    """Open a tab of the viewport's sidebar."""
    view().show_region_ui = True
    yield 2 * DRAWN  # a sidebar knows its tabs when it was drawn
    region("UI").active_panel_category = cast(Any, name)
    yield DRAWN


def to_window(points: Iterable[Iterable[float]]) -> list[Pixel]:
    """Where in the window points (N, 3) of the world are seen, once that is drawn."""
    _camera().update()
    place = region()
    seen = (view3d_utils.location_3d_to_region_2d(place, _camera(), (*p,)) for p in points)
    return [(place.x + p.x, place.y + p.y) for p in seen if p is not None]


def _camera() -> RegionView3D:
    camera = view().region_3d
    assert camera is not None
    return camera


def screen_pixels() -> NDArray[np.uint8]:
    """The screen as it is: (H, W, 3)."""
    data = Path(os.environ[SCREEN_FILE]).read_bytes()
    head = struct.unpack(">25I", data[:100])  # of the X Window Dump, XWDFile.h
    header_size, width, height, row, colors = head[0], head[4], head[5], head[12], head[19]
    pixels = np.frombuffer(data, np.uint8, height * row, header_size + 12 * colors)
    return pixels.reshape(height, row)[:, : 4 * width].reshape(height, width, 4)[..., 2::-1]


def save_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write (H, W, 3) as a PNG."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # a row begins with its filter, none
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        body = kind + content
        return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    packed = zlib.compress(rows.tobytes(), 6)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
    )


def play(steps: Steps) -> None:
    """Step a generator from a timer; then leave Blender, with exit code 1 if it raised."""

    def step() -> float | None:
        code = 0
        try:
            return next(steps)
        except StopIteration:
            pass
        except BaseException:  # noqa: BLE001 - a timer's exceptions would only be printed
            traceback.print_exc()
            code = 1
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)

    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(step, first_interval=0.5, persistent=True)
    if bpy.app.use_event_simulate:
        bpy.app.timers.register(_rest, persistent=True)


def _rest() -> float:
    """Rest, as Blender does by itself when there is no event, but not with --enable-event-simulate:
    its main loop would take a core from the worker and from whatever runs beside it."""
    time.sleep(RESTED)
    return 0.0
