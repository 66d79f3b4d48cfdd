# SPDX-License-Identifier: GPL-3.0-or-later
"""The shapes of the paper as fields without detail, 3-128-128-1.

sphere          radius 0.6; our fit, the package's primitive
torus           radii 0.45 and 0.25; our fit of the closed form, made once and kept
bunny, bust, pumpkin, frog
                the authors' networks, where ../shared/data/networks has them
stanford-bunny  our fit of the mesh, where ../shared/data/meshes has it; others there likewise

Model space.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from workshop import ROOT

from neural_sculpt_addon.field.checkpoint import load, save
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.fit.fit import fit_mesh
from neural_sculpt_addon.field.mesh import mesh_file
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import prepare

from .methods.methods import Scene

DATA = ROOT.parent / "shared" / "data"
OURS = ("sphere", "torus")  # the authors' networks of these have other radii


def torus(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of points (..., 3) from the paper's torus, around z."""
    return np.hypot(np.hypot(x[..., 0], x[..., 1]) - 0.45, x[..., 2]) - 0.25


def is_there(name: str) -> bool:
    """Whether the shape can be had on this computer."""
    return name in OURS or _network(name).is_file() or _mesh(name).is_file()


def field_of(name: str, folder: Path) -> Field:
    """The shape called `name`; fits are kept in `folder`."""
    if name == "sphere":
        return primitive("sphere")
    if name not in OURS and (path := _network(name)).is_file():
        return load(path)
    kept = folder / f"{name}.safetensors"
    if not kept.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        save(_fitted(name), kept)
    return load(kept)


def scene_of(name: str, folder: Path, cells: int) -> Scene:
    """The shape, prepared for strokes."""
    field = field_of(name, folder)
    return Scene(prepare(field), extract(field, cells))


def _fitted(name: str) -> Field:
    if name == "torus":
        from make_primitives import fit_closed_form

        return fit_closed_form(torus)
    return fit_mesh(*mesh_file.read(_mesh(name)), detail=False, preset="fine").field


def _network(name: str) -> Path:
    return DATA / "networks" / f"{name}.pth"


def _mesh(name: str) -> Path:
    return DATA / "meshes" / f"{name}.obj"
