# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of refinement in docs/method.md.

A thin inscription on a sphere, as the uniform proxy of 128 cells, the refined one and the uniform
one of 512 cells show it. Writes docs/refined.jpg.
"""

from typing import TYPE_CHECKING

from workshop import ROOT

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from neural_sculpt_addon.field.field import Field
    from neural_sculpt_addon.field.mesh.proxy import Proxy
    from neural_sculpt_addon.field.mesh.refinement.refine import Refined

    Array = NDArray[np.float64]

TARGET = ROOT / "docs" / "refined.jpg"
RADIUS, DEPTH = 0.016, -0.01  # of the strokes, model units
HEIGHT, GAP = 0.17, 0.06  # of letters and between them
HALF = 0.3  # of what is seen
SIZE = 480  # pixels
OVER = 2  # samples along the edge of a pixel
LIGHT = (-0.75, 0.45, 0.5)
LETTERS = (
    (0.6, [[(0, 0), (0, 1), (0.6, 1)], [(0, 0.55), (0.5, 0.55)]]),
    (0.0, [[(0, 0), (0, 1)]]),
    (0.7, [[(0, 0), (0, 1), (0.7, 0), (0.7, 1)]]),
    (0.6, [[(0.6, 0), (0, 0), (0, 1), (0.6, 1)], [(0, 0.52), (0.5, 0.52)]]),
)
"""How wide each is, and its lines, in heights of a letter."""


def write() -> None:
    """Write the picture."""
    import numpy as np
    from PIL import Image, ImageDraw

    from neural_sculpt_addon.field.mesh.proxy import extract
    from neural_sculpt_addon.field.mesh.refinement.refine import refine

    field = _inscribed()
    coarse = extract(field, 128)
    shown = {
        "128": coarse,
        "128, refined": refine(field, coarse, 300_000),
        "512": extract(field, 512),
    }
    tiles = []
    for name, mesh in shown.items():
        tile = Image.fromarray(_drawn(mesh))
        said = f"{name}: {len(mesh.triangles):,} triangles"
        ImageDraw.Draw(tile).text((12, SIZE - 32), said, (40, 40, 40), font_size=20)
        tiles.append(np.asarray(tile))
    Image.fromarray(np.concatenate(tiles, axis=1)).save(TARGET, quality=90)


def _inscribed() -> "Field":
    """The sphere with the letters on its top."""
    import numpy as np

    from neural_sculpt_addon.field.edit.edit import sculpt
    from neural_sculpt_addon.field.primitives import primitive
    from neural_sculpt_addon.field.problem.prepare import prepare
    from neural_sculpt_addon.stroke.brush import Brush
    from neural_sculpt_addon.stroke.stroke import Stroke

    now = prepare(primitive("sphere"))
    size = np.linalg.norm(now.proxy.vertices, axis=1).mean()
    whole = sum(width * HEIGHT + GAP for width, _ in LETTERS) - GAP
    left = -whole / 2
    for width, lines in LETTERS:
        for line in lines:
            corners = np.array(line, float) * HEIGHT + (left, -HEIGHT / 2)
            ways = np.linspace(0, len(corners) - 1, 12 * (len(corners) - 1) + 1)
            flat = [np.interp(ways, np.arange(len(corners)), axis) for axis in corners.T]
            points = np.stack([*flat, np.sqrt(size**2 - flat[0] ** 2 - flat[1] ** 2)], axis=1)
            now = sculpt(now, Stroke(points, Brush(RADIUS, DEPTH))).preparation
        left += width * HEIGHT + GAP
    return now.field


def _drawn(mesh: "Proxy | Refined") -> "NDArray[np.uint8]":
    """The mesh seen from above (SIZE, SIZE, 3): each triangle as points, the highest of each pixel
    shaded by the normals of its corners."""
    import numpy as np

    pixels = SIZE * OVER
    corners = mesh.vertices[mesh.triangles].astype(float)
    near = (corners[..., 2] > 0).all(axis=1) & (np.abs(corners[..., :2]) < HALF * 1.1).all((1, 2))
    corners, normals = corners[near], mesh.normals[mesh.triangles[near]].astype(float)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    steps = int(np.ceil(1.5 * longest / (2 * HALF / pixels)))
    u, v = np.meshgrid(np.arange(steps + 1), np.arange(steps + 1))
    inside = u + v <= steps
    weights = np.stack([u[inside], v[inside], steps - u[inside] - v[inside]], axis=1) / steps
    height = np.full(pixels * pixels, -np.inf)
    shade = np.ones(pixels * pixels)
    light = np.array(LIGHT) / np.linalg.norm(LIGHT)
    lit = normals @ light  # (F, 3)
    for weight in weights:
        points = weight @ corners
        place = ((points[:, :2] * (1, -1) / HALF + 1) / 2 * pixels).astype(int)
        seen = ((place >= 0) & (place < pixels)).all(axis=1)
        index = place[seen, 1] * pixels + place[seen, 0]
        order = np.argsort(points[seen, 2], kind="stable")
        index, level = index[order], points[seen, 2][order]
        higher = level > height[index]
        height[index[higher]] = level[higher]
        shade[index[higher]] = (lit[seen] @ weight)[order][higher]
    grey = (0.12 + 0.88 * shade.clip(0, 1)).reshape(SIZE, OVER, SIZE, OVER).mean(axis=(1, 3))
    return (255 * grey[..., None] * (0.98, 0.86, 0.76)).astype(np.uint8)
