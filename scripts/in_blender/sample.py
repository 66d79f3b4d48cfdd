# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample file inside Blender: two fields with named strokes, a mask, a picture. Needs bpy.

A stroke is given by places that are pulled onto the surface: those of a face are seen from the
front, (x, z); those of a skull are directions from its middle, degrees to the side and upward.
Model space.
"""

import math
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, cast

import bpy
import numpy as np
from bpy.types import Camera, Mesh, Object
from mathutils import Vector
from numpy.typing import NDArray
from workshop.virtualenv import say

import neural_sculpt_addon
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.curve import fit_curve
from neural_sculpt_addon.stroke.file import dump_strokes
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke

from . import studio

Place = tuple[float, float]

LENS, SIZE = 84.0, (640, 540)  # mm; pixels of one of both pictures
ASIDE = 0.07  # of the picture's width: the head looks to its left edge
FINE = 256  # cells of the proxy that is rendered
MIDDLE = Vector((0.0, 0.0, 0.12))  # of the skull
OUTSIDE = 2.0
POINTS = 40  # of a stroke
GROOVE = Profile(points=((-1, 0), (-0.55, 0.45), (0, -1), (0.55, 0.45), (1, 0)))
MASKED = (0.5, 0.6)  # |x| where the mask of the ears begins, and where it is whole


class Line(NamedTuple):
    """A stroke before it lies on the surface."""

    name: str
    places: tuple[Place, ...]
    radius: float
    intensity: float
    modulation: str = "central"
    profile: Profile = Profile("quintic")
    skull: bool = False
    mirrored: bool = True
    closed: bool = False


def _ring(x: float, z: float, radius: float) -> tuple[Place, ...]:
    angles = np.linspace(0, 2 * math.pi, 16, endpoint=False).tolist()
    return tuple((x + radius * math.cos(a), z + radius * math.sin(a)) for a in angles)


HEAD = (
    Line("Crest", ((0, 52), (0, 90), (0, 140)), 0.05, 0.06, skull=True, mirrored=False),
    *(
        Line(f"Crest {n}", ((a, 42), (1.15 * a, 56), (1.3 * a, 70)), 0.035, 0.035, skull=True)
        for n, a in ((2, 20), (3, 38), (4, 56), (5, 74), (6, 92))
    ),
    Line("Brow", ((0.05, 0.25), (0.17, 0.34), (0.31, 0.32), (0.38, 0.22)), 0.05, 0.045),
    Line("Third Eye", _ring(0, 0.44, 0.05), 0.02, 0.02, "identity", mirrored=False, closed=True),
    Line("Pupil", ((0, 0.44),), 0.03, 0.03, "identity", mirrored=False),
    Line("Eye", _ring(0.21, 0.15, 0.085), 0.02, 0.016, "identity", closed=True),
    Line("Bridge", ((0, 0.25), (0, 0.12), (0, 0.0)), 0.035, 0.03, mirrored=False),
    *(
        Line(f"Wrinkle {n}", ((0.02, z), (0.06, z + 0.015), (0.1, z + 0.05)), 0.016, -0.012)
        for n, z in ((1, 0.06), (2, 0.02), (3, -0.02))
    ),
    Line("Upper Lip", ((-0.17, -0.3), (0, -0.27), (0.17, -0.3)), 0.03, 0.03, mirrored=False),
    Line("Lower Lip", ((-0.14, -0.39), (0, -0.41), (0.14, -0.39)), 0.03, 0.03, mirrored=False),
    Line("Mouth", ((-0.16, -0.34), (0, -0.34), (0.16, -0.34)), 0.025, -0.035, mirrored=False),
    *(
        Line(f"Beard {n}", ((x, -0.46), (x, -0.5), (x, -0.54)), 0.02, -0.012, mirrored=x > 0)
        for n, x in ((1, 0.0), (2, 0.05), (3, 0.1))
    ),
)
EGG = (
    Line(
        "Band",
        tuple((a, 20 * math.sin(math.radians(3 * a))) for a in range(0, 360, 12)),
        *(0.14, 0.09, "identity", GROOVE),
        skull=True,
        mirrored=False,
        closed=True,
    ),
    Line("Tip", ((0, 90),), 0.2, 0.12, "identity", skull=True, mirrored=False),
)


def make(sample: Path, picture: Path) -> None:
    """Write the file and the picture."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    neural_sculpt_addon.register()
    try:
        head = _add("SUZANNE", "Head")
        camera = studio.set_up(head)
        lens = cast(Camera, camera.data)
        lens.lens, lens.shift_x = LENS, ASIDE
        render = bpy.context.scene.render
        render.resolution_x, render.resolution_y = SIZE
        with TemporaryDirectory() as folder:
            parts = [Path(folder) / name for name in ("before.png", "after.png")]
            _render(head, parts[0])
            _sculpt(head, HEAD)
            _render(head, parts[1])
            _join(parts, picture)
        _mask(head)
        egg = _add("SPHERE", "Egg")
        egg.location, egg.scale = (0.62, -0.62, -0.42), (0.24, 0.24, 0.3)
        cast(Mesh, egg.data).materials.append(cast(Mesh, head.data).materials[0])
        _sculpt(egg, EGG)
        _choose(head)
        bpy.ops.wm.save_as_mainfile(filepath=str(sample), compress=True)
    finally:
        neural_sculpt_addon.unregister()


def _add(kind: str, name: str) -> Object:
    _operators().add(kind=kind)
    ob = bpy.context.active_object
    assert ob is not None
    ob.name = name
    return ob


def _sculpt(ob: Object, lines: Iterable[Line]) -> None:
    """One stroke after another, each on the surface as the one before has left it."""
    _choose(ob)
    for line in lines:
        say(f"{ob.name}: {line.name}")
        stroke = Stroke(
            _on(ob, line),
            Brush(line.radius, line.intensity, line.profile, Modulation(line.modulation)),
            closed=line.closed,
            mirror=frozenset("X" if line.mirrored else ""),
            name=line.name,
        )
        _operators().stroke(stroke_json=dump_strokes([stroke]))


def _on(ob: Object, line: Line) -> NDArray[np.float64]:
    """The places of a line on the surface (K, 3)."""
    flat = np.pad(np.array(line.places, float), ((0, 0), (0, 1)))  # (K, 3)
    if len(flat) > 1:
        flat = fit_curve(flat, line.closed).resample(POINTS)[0][: -1 if line.closed else None]
    points = []
    for a, b, _ in flat.tolist():
        if line.skull:
            side, up = math.radians(a), math.radians(b)
            away = Vector((math.sin(side) * math.cos(up), -math.cos(side) * math.cos(up), 0))
            away.z = math.sin(up)
            start, ahead = MIDDLE + OUTSIDE * away, -away
        else:
            start, ahead = Vector((a, -OUTSIDE, b)), Vector((0, 1, 0))
        hit, point, *_ = ob.ray_cast(start, ahead)
        assert hit, f"{line.name} misses the surface"
        points.append(point)
    return np.array(points)


def _mask(ob: Object) -> None:
    """Protect the ears, as painted with the brush Mask."""
    mesh = cast(Mesh, ob.data)
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    beside = np.abs(points[::3])
    share = np.clip((beside - MASKED[0]) / (MASKED[1] - MASKED[0]), 0, 1).astype(np.float32)
    attribute: Any = mesh.attributes.new(".sculpt_mask", "FLOAT", "POINT")
    attribute.data.foreach_set("value", share)


def _render(ob: Object, path: Path) -> None:
    """Render a finer proxy than the one that the file is to hold."""
    coarse = cast(Any, ob).neural_sculpt.resolution
    _operators().remesh(resolution=FINE)
    say(f"Rendering {path.name}")
    studio.render(path)
    _operators().remesh(resolution=coarse)


def _join(parts: Iterable[Path], picture: Path) -> None:
    """Write pictures side by side as a JPEG."""
    pixels = []
    for part in parts:
        image = bpy.data.images.load(str(part))
        width, height = cast(tuple[int, int], image.size)
        flat = np.empty(4 * width * height, np.float32)
        cast(Any, image.pixels).foreach_get(flat)
        pixels.append(flat.reshape(height, width, 4))
        bpy.data.images.remove(image)
    joined = np.concatenate(pixels, axis=1)
    height, width, _ = joined.shape
    image = bpy.data.images.new("Picture", width, height)
    cast(Any, image.pixels).foreach_set(joined.ravel())
    image.filepath_raw, image.file_format = str(picture), "JPEG"
    image.save(quality=85)
    bpy.data.images.remove(image)


def _choose(ob: Object) -> None:
    for other in bpy.context.view_layer.objects:
        other.select_set(other == ob)
    bpy.context.view_layer.objects.active = ob
    bpy.context.view_layer.update()


def _operators() -> Any:
    """Neural Sculpt's operators, which came with its registration."""
    return cast(Any, bpy.ops).neural_sculpt
