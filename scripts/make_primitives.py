# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the ready fields of neural_sculpt_addon/primitives.

    .venv/bin/python scripts/make_primitives.py [NAME ...]

Sphere, torus, box and capsule learn their closed-form distances, Suzanne the mesh that Blender
makes. The same machine gives the same bytes.
"""

import argparse
from collections.abc import Callable

import numpy as np
import torch
import workshop  # noqa: F401 - makes the package importable
from numpy.typing import NDArray

from neural_sculpt_addon.common.progress import silent
from neural_sculpt_addon.field.checkpoint import save
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.fit.fit import fit_mesh
from neural_sculpt_addon.field.fit.fit_distance import SAMPLED_BOX, Learner, TrainingSamples
from neural_sculpt_addon.field.fit.schedule import Schedule, train
from neural_sculpt_addon.field.network import Siren
from neural_sculpt_addon.field.primitives import FOLDER, PRIMITIVES

Array = NDArray[np.float64]

SCHEDULE = Schedule(steps=6000, batch=1024, samples=200_000, rate=1.2e-3, omega=42.0)
SHARE_NEAR, NEAR = 0.8, 0.05  # share of the samples within this distance of the surface
STEP = 1e-5  # of the central differences that give a closed form's gradient


def sphere(x: Array) -> Array:
    """Distance to a sphere of radius 0.6."""
    return np.linalg.norm(x, axis=-1) - 0.6


def torus(x: Array) -> Array:
    """Distance to a torus around z of radii 0.5 and 0.2."""
    return np.hypot(np.hypot(x[..., 0], x[..., 1]) - 0.5, x[..., 2]) - 0.2


def box(x: Array) -> Array:
    """Distance to a cube of edge 1.2."""
    beyond = np.abs(x) - 0.6
    return np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(axis=-1), 0)


def capsule(x: Array) -> Array:
    """Distance to a capsule of radius 0.35 around the segment from z = -0.4 to z = 0.4."""
    axial = x[..., 2] - np.clip(x[..., 2], -0.4, 0.4)
    return np.sqrt(x[..., 0] ** 2 + x[..., 1] ** 2 + axial**2) - 0.35


CLOSED_FORMS: dict[str, Callable[[Array], Array]] = {
    "sphere": sphere,
    "torus": torus,
    "box": box,
    "capsule": capsule,
}


def fit_closed_form(distance: Callable[[Array], Array]) -> Field:
    """A field that learned `distance`, a function of points (N, 3) -> (N,)."""
    rng = np.random.default_rng(0)
    count = int(SHARE_NEAR * SCHEDULE.samples)
    candidates = rng.uniform(-SAMPLED_BOX, SAMPLED_BOX, (40 * SCHEDULE.samples, 3))
    near = candidates[np.abs(distance(candidates)) < NEAR][:count]
    points = np.concatenate([near, candidates[: SCHEDULE.samples - len(near)]])
    steps = STEP * np.eye(3)
    gradient = np.stack(
        [(distance(points + step) - distance(points - step)) / (2 * STEP) for step in steps], axis=1
    )
    arrays = (points, distance(points), gradient[: len(near)])
    samples = TrainingSamples(*(torch.from_numpy(array.astype(np.float32)) for array in arrays))
    network = Siren.random(omega=(SCHEDULE.omega, 30.0), generator=torch.Generator().manual_seed(0))
    learner = Learner(samples, network, SCHEDULE.batch, seed=0)
    train(learner, SCHEDULE, silent)
    field = Field(learner.network)
    error = np.abs(values(field, points) - distance(points))[: len(near)]
    print(f"  error near the surface: mean {error.mean():.1e}, max {error.max():.1e}")
    return field


def fit_suzanne() -> Field:
    """A field that learned Blender's monkey, subdivided twice."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    assert monkey is not None
    subdivision = monkey.modifiers.new("Subdivision", "SUBSURF")
    assert isinstance(subdivision, bpy.types.SubsurfModifier)
    subdivision.levels = 2
    mesh = monkey.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    fit = fit_mesh(vertices.reshape(-1, 3), triangles.reshape(-1, 3), preset="fine", detail=False)
    print(f"  {fit.report}")
    return fit.field


def main() -> None:
    """Fit the primitives named on the command line, or all of them."""
    parser = argparse.ArgumentParser(description="Fit the ready fields of the package.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PRIMITIVES))
    names = parser.parse_args().names or PRIMITIVES
    torch.set_num_threads(1)
    FOLDER.mkdir(exist_ok=True)
    for name in names:
        print(name, flush=True)
        form = CLOSED_FORMS.get(name)
        save(fit_closed_form(form) if form else fit_suzanne(), FOLDER / f"{name}.safetensors")


if __name__ == "__main__":
    main()
