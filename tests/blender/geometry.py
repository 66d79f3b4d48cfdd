# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes and distances by NumPy alone, for tests in Blender and in pytest."""

import numpy as np


def square(count: int = 81) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (count^2, 3) of [-0.8, 0.8]^2 in the plane z = 0, and triangles that look up."""
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, count), np.linspace(-0.8, 0.8, count), indexing="ij")
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = np.arange(count**2, dtype=np.int32).reshape(count, count)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    return points, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def to_path(points: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Distances (N,) of points (N, 3) from a polyline (K, 3)."""
    start, along = path[:-1], np.diff(path, axis=0)  # (K - 1, 3)
    offset = points[:, None] - start  # (N, K - 1, 3)
    t = np.clip((offset * along).sum(-1) / (along**2).sum(-1), 0, 1)  # (N, K - 1)
    return np.linalg.norm(offset - t[..., None] * along, axis=-1).min(1)
