# SPDX-License-Identifier: GPL-3.0-or-later
"""Specks: small pieces of a mesh that only its lattice tears off (docs/method.md, section 8).

A ridge or a groove thinner than a cell passes between most of the lattice's points. Where one of
them happens to lie within it, marching cubes draw a small piece by itself, though the field hangs
together there. The field is sampled several times as finely in a box around the piece: where the
inside goes on to the border of that box, the piece is a speck. One that is closed there, too, is
not. Model space.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ...evaluate import values
from ...field import Field
from ..components import Components, signed_volumes

SMALL_PIECE = 50
"""Vertices: a piece with fewer is some three cells wide, and is looked at."""

SPECK_BORDER, SPECK_SAMPLES = 0.75, 3
"""Cells around such a piece that are sampled, and samples along the edge of one."""


def find_specks(
    field: Field,
    places: NDArray[np.float32],
    triangles: NDArray[np.int32],
    pieces: Components,
    spacing: float,
    check: Callable[[], None],
) -> NDArray[np.bool_]:
    """Which vertices of the field's mesh belong to specks (V,).

    places:    (V, 3), the centres of the lattice edges that the vertices come from: they say
               whether a piece is a speck, however vertices were moved since
    triangles: (F, 3)
    pieces:    of that mesh
    spacing:   edge of a cell of the lattice, in model space
    check:     is called now and then, and may raise
    """
    count, labels = pieces
    is_small = np.bincount(labels, minlength=count) < SMALL_PIECE
    if is_small.all() or not is_small.any():
        return np.zeros(len(places), bool)
    vertices = np.flatnonzero(is_small.take(labels))
    vertices = vertices[np.argsort(labels.take(vertices), kind="stable")]
    chosen, starts = np.unique(labels.take(vertices), return_index=True)
    parts = np.split(places.take(vertices, axis=0), starts[1:])
    triangles = triangles.compress(is_small.take(labels.take(triangles[:, 0])), axis=0)
    volumes = signed_volumes(places, triangles, labels, count).take(chosen)
    boxes = [_box(part, spacing) for part in parts]
    check()
    f = values(field, np.concatenate([box.reshape(-1, 3) for box in boxes]))
    ends = np.cumsum([box.size // 3 for box in boxes])[:-1]
    specks = np.zeros(count, bool)
    for piece, part, volume, box, inside in zip(
        chosen, parts, volumes, boxes, np.split(f, ends), strict=True
    ):
        check()
        enclosed = np.sign(volume) * inside.reshape(box.shape[:3]) < 0
        specks[piece] = _leads_on(box, enclosed, part.mean(axis=0))
    return specks[labels]


def _box(piece: NDArray[np.float32], spacing: float) -> NDArray[np.float32]:
    """Points (X, Y, Z, 3) of a lattice in the box around the places (P, 3) of a `piece`."""
    low, high = (
        piece.min(axis=0) - SPECK_BORDER * spacing,
        piece.max(axis=0) + SPECK_BORDER * spacing,
    )
    counts = np.ceil((high - low) / spacing * SPECK_SAMPLES).astype(int) + 1
    axes = [np.linspace(*ends, dtype=np.float32) for ends in zip(low, high, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def _leads_on(
    points: NDArray[np.float32], enclosed: NDArray[np.bool_], middle: NDArray[np.float32]
) -> bool:
    """Whether what a piece around `middle` (3,) encloses leads out of the box around it.

    points:   (X, Y, Z, 3) of the box
    enclosed: (X, Y, Z), which of them lie on the piece's inner side
    """
    if not enclosed.any():
        return True  # thinner than can be seen
    away = np.linalg.norm(points - middle, axis=-1)
    nearest = np.unravel_index(np.where(enclosed, away, np.inf).argmin(), enclosed.shape)
    parts = np.empty(enclosed.shape, np.int32)
    ndimage.label(enclosed, np.ones((3, 3, 3)), output=parts)
    same = parts == parts[nearest]
    return any(same.take(end, axis=axis).any() for axis in range(3) for end in (0, -1))
