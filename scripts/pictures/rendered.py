# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of fields as Blender renders them: meshes in the studio of `in_blender.views`.

The meshes are turned so that the camera looks along +Y and up is +Z, as the studio's lights expect.
"""

import json
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from in_blender import START
from PIL import Image
from workshop import environment

from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh import mesh_file
from neural_sculpt_addon.field.mesh.proxy import extract

from .field_picture import CELLS, Camera
from .sheet import Picture


def pictures(fields: Sequence[Field], camera: Camera, size: int) -> list[Picture]:
    """Each field as (size, size, 3), on white."""
    right, up, toward = camera.axes
    turn = np.array([right, -toward, up])
    with TemporaryDirectory() as name:
        meshes = [Path(name) / f"{number:03}.ply" for number in range(len(fields))]
        for path, field in zip(meshes, fields, strict=True):
            proxy = extract(field, CELLS)
            vertices = ((proxy.vertices - camera.target) @ turn.T).astype(np.float32)
            normals = (proxy.normals @ turn.T).astype(np.float32)
            mesh_file.write(path, replace(proxy, vertices=vertices, normals=normals))
        view = json.dumps({"half": camera.half, "size": size})
        command = [str(environment.ensure().blender), str(START), "in_blender.views", view]
        command += map(str, meshes)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # each sample is told
        return [_on_white(path.with_suffix(".png")) for path in meshes]


def _on_white(path: Path) -> Picture:
    with Image.open(path) as rendered:
        page = Image.new("RGBA", rendered.size, "white")
        page.alpha_composite(rendered.convert("RGBA"))
    return np.asarray(page.convert("RGB"))
