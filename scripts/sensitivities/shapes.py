# SPDX-License-Identifier: GPL-3.0-or-later
"""Held-out meshes: generated, and no benchmark has them.

Vertices (V, 3), in any unit, and triangles (F, 3), counter-clockwise seen from outside.
"""

import numpy as np
import trimesh
from benchmarking.awkward_meshes import ball, box
from benchmarking.damaged_meshes import Mesh, joined


def ripples() -> Mesh:
    """A smooth ball whose waves become shorter from one end to the other."""
    vertices, triangles = ball(1.0, fine=6)
    x, y, z = vertices.T
    waves = np.sin(6 * (z + 1.6) ** 2.2) * np.cos(2 * np.arctan2(y, x))
    return vertices * (1 + 0.03 * waves[:, None]), triangles


def knot() -> Mesh:
    """A trefoil of a thin tube, and a bead beside it."""
    around, across = 240, 32
    t = np.linspace(0, 2 * np.pi, around, endpoint=False)
    line = np.stack(
        [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1
    )
    ahead = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0)
    side = np.cross(ahead, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, ahead)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    turn = np.linspace(0, 2 * np.pi, across, endpoint=False)[:, None]
    tube = line[:, None] + 0.35 * (
        np.cos(turn) * side[:, None] + np.sin(turn) * up[:, None]
    )  # (around, across, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    triangles = np.concatenate(
        [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (a, c, d))]
    )
    return joined(outward((tube.reshape(-1, 3), triangles)), ball(0.25, at=(0, 0, 0.2), fine=3))


def bracket() -> Mesh:
    """Two thin plates and a pin that stick into each other."""
    pin = trimesh.creation.cylinder(0.2, 0.9, sections=48).apply_translation((0.3, 0, 0.3))
    return joined(
        box((1.6, 1.0, 0.08)),
        box((0.08, 1.0, 0.9), (-0.7, 0, 0.4)),
        (pin.vertices, pin.faces),
    )


SHAPES = {"ripples": ripples, "knot": knot, "bracket": bracket}
"""What fits are measured by."""


def outward(mesh: Mesh) -> Mesh:
    """A closed mesh whose faces look outward."""
    a, b, c = np.moveaxis(mesh[0][mesh[1]], 1, 0)
    volume = np.einsum("fi,fi->", a, np.cross(b, c))
    return mesh[0], mesh[1] if volume > 0 else mesh[1][:, ::-1]
