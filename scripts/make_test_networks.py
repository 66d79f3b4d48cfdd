# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the small networks of tests/field/packed to meshes that are made here.

    .venv/worker/bin/python scripts/make_test_networks.py [NAME ...]

They stand in for pretrained networks, which are not part of the project: a smooth shape, one with
creases, one with thin limbs. The same machine gives the same bytes.
"""

import argparse
from collections.abc import Callable
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from workshop import ROOT

from neural_sculpt_addon.field.checkpoint import save
from neural_sculpt_addon.field.fit.fit import fit_mesh

Mesh = tuple[NDArray[np.float64], NDArray[Any]]
"""Vertices (V, 3), in any unit, and triangles (F, 3), counter-clockwise seen from outside."""

FOLDER = ROOT / "tests" / "field" / "packed"
WIDTH = 64  # units of a layer: 20 kB a network


def blob() -> Mesh:
    """A smooth lumpy ball of radius 1, its lumps up to 0.2 high."""
    vertices, triangles = _ball(5)
    x, y, z = vertices.T
    lumps = np.sin(3 * x + 1) * np.sin(3 * y) + np.cos(3 * z) * np.sin(2 * x)  # (V,)
    return vertices * (1 + 0.1 * lumps[:, None]), triangles


def gear() -> Mesh:
    """A part with creases: eight square teeth, of radius 1 and 0.75 between them, 0.6 high."""
    turn = np.pi / 8 * (np.arange(16)[:, None] + [0.0, 0.999])  # (16, 2): where each arc ends
    radius = np.array([1.0, 0.75] * 8)[:, None]
    outline = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1).reshape(-1, 2)
    count = len(outline)
    rim = np.arange(count)
    following = np.roll(rim, -1)
    vertices = np.zeros((2 * count + 2, 3))
    vertices[:-2, :2] = np.tile(outline, (2, 1))
    vertices[:, 2] = [*[-0.3] * count, *[0.3] * count, -0.3, 0.3]
    triangles = [
        (rim, following, following + count),
        (rim, following + count, rim + count),
        (following, rim, np.full(count, 2 * count)),
        (rim + count, following + count, np.full(count, 2 * count + 1)),
    ]
    return vertices, np.concatenate([np.column_stack(part) for part in triangles])


def star() -> Mesh:
    """Thin limbs: six of length 1 along the axes, a fifth as thick, out of a ball of radius 0.3."""
    vertices, triangles = _ball(6)
    limb = np.exp(60 * (np.abs(vertices).max(axis=1) - 1))  # (V,)
    return vertices * (0.3 + 0.7 * limb[:, None]), triangles


SHAPES: dict[str, Callable[[], Mesh]] = {"blob": blob, "gear": gear, "star": star}


def _ball(subdivisions: int) -> Mesh:
    """A unit sphere."""
    ball = trimesh.creation.icosphere(subdivisions)
    return np.array(ball.vertices), np.array(ball.faces)


def main() -> None:
    """Fit the networks named on the command line, or all of them."""
    parser = argparse.ArgumentParser(description="Fit the small networks of the tests.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SHAPES))
    FOLDER.mkdir(exist_ok=True)
    for name in parser.parse_args().names or SHAPES:
        fit = fit_mesh(*SHAPES[name](), detail=False, width=WIDTH)
        save(fit.field, FOLDER / f"{name}.pth")
        print(name, fit.report, flush=True)


if __name__ == "__main__":
    main()
