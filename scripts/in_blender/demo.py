# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo inside Blender: makes a field, draws strokes, renders, saves. Needs bpy."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import bpy
from workshop.virtualenv import say

import neural_sculpt_addon
from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.stroke.file import dump_strokes, parse_strokes

from . import demo_strokes, studio

IMPORTERS = {".obj": "obj_import", ".ply": "ply_import", ".stl": "stl_import"}


def sculpt(output: Path, mesh: Path | None, network: Path | None, strokes: Path | None) -> None:
    """Fill the folder `output`. RuntimeError tells what an operator or the input refused."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    neural_sculpt_addon.register()
    try:
        given = parse_strokes(strokes.read_text(encoding="utf-8")) if strokes else ()
        output.mkdir(exist_ok=True)
        ob = _load(network) if network else _fit(mesh)
        camera = studio.set_up(ob)
        with _step("Rendering before.png"):
            studio.render(output / "before.png")
        for stroke in given or demo_strokes.draw(ob, camera):
            with _step(f"Sculpting {stroke.name or 'a stroke'}"):
                _operators().stroke(stroke_json=dump_strokes([stroke]))
        with _step("Rendering after.png"):
            studio.render(output / "after.png")
        _operators().export(filepath=str(output / "sculpted.obj"))
        bpy.ops.wm.save_as_mainfile(filepath=str(output / "sculpted.blend"), compress=True)
    except (OSError, UnicodeError, SculptError) as error:
        raise RuntimeError(str(error)) from error
    finally:
        neural_sculpt_addon.unregister()
    say(f"{output.name}/ has before.png, after.png, sculpted.blend and sculpted.obj.")


def _fit(path: Path | None) -> bpy.types.Object:
    """A field fitted to Suzanne or to the mesh in a file."""
    if path is None:
        bpy.ops.mesh.primitive_monkey_add()
        bpy.ops.object.subdivision_set(level=2)
    else:
        getattr(bpy.ops.wm, IMPORTERS[path.suffix.lower()])(filepath=str(path))
        meshes = [ob for ob in bpy.context.selected_objects or () if ob.type == "MESH"]
        if not meshes:
            raise SculptError(f"There is no mesh in {path.name}; choose another file.")
        bpy.context.view_layer.objects.active = meshes[0]
        if len(meshes) > 1:
            bpy.ops.object.join()
    source = _active()
    with _step(f"Fitting a neural field to {source.name}"):
        _operators().from_mesh(preset="NORMAL")
    return _active()


def _load(path: Path) -> bpy.types.Object:
    """A field from a network file."""
    with _step(f"Loading {path.name}"):
        _operators().add(kind="FILE", filepath=str(path))
    ob = _active()
    if path.suffix.lower() == ".pth":  # not from Blender, so Y is up
        ob.rotation_euler.x = math.pi / 2
    return ob


def _operators() -> Any:
    """Neural Sculpt's operators, which came with its registration."""
    return cast(Any, bpy.ops).neural_sculpt


def _active() -> bpy.types.Object:
    ob = bpy.context.active_object
    assert ob is not None
    return ob


@contextmanager
def _step(text: str) -> Iterator[None]:
    say(text)
    start = time.monotonic()
    yield
    say(f"  {time.monotonic() - start:.1f} s")
