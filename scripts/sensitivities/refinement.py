# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy of sculpted fields and its refinement (docs/method.md, section 8)."""

from functools import cache, partial

import igl
import numpy as np
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values_and_gradients
from neural_sculpt_addon.field.field import Field
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.mesh.refinement.refine import Refined, refine
from neural_sculpt_addon.field.mesh.surface import sample_surface

from .strokes import SHAPES, drawn, packed
from .subject import Case, Made, Subject, array_bits

STROKES = 5  # upon one another, on each field
CELLS, FINE = 128, 320  # per axis: of the proxy, and of that by which it is judged
SAMPLES = 40_000
SLIVER = 5  # degrees
MANY = 10**7  # triangles: no budget
DEEP = 0.05  # model units


@cache
def sculpted(shape: str, seed: int, more: int) -> Field:
    """A field after some strokes; those that are refused are left out."""
    now = packed(shape)
    for number in range(STROKES):
        try:
            now = sculpt(now, drawn(now, seed, number, more, DEEP)).preparation
        except SculptError:
            continue
    return now.field


def cases(count: int, seed: int, more: int) -> list[Case]:
    """Sculpted fields."""
    names = [SHAPES[number % len(SHAPES)] for number in range(count)]
    fields = [sculpted(name, seed + 100 * number, more) for number, name in enumerate(names)]
    return [partial(_refined, field, _true(field)) for field in fields]


@cache
def _true(field: Field) -> np.ndarray:
    """Points (N, 3) of the surface."""
    return sample_surface(field, extract(field, FINE), SAMPLES, 1).points


def _refined(field: Field, true: np.ndarray) -> Made:
    mesh = refine(field, extract(field, CELLS), MANY)
    return Made(array_bits(mesh.vertices, mesh.triangles), partial(_measured, field, mesh, true))


def _measured(field: Field, mesh: Refined, true: np.ndarray) -> dict[str, float]:
    vertices, triangles = mesh.vertices.astype(float), mesh.triangles.astype(np.int64)
    distance = np.sqrt(igl.point_mesh_squared_distance(true.astype(float), vertices, triangles)[0])
    shape = trimesh.Trimesh(vertices, triangles, process=False)
    outward = values_and_gradients(field, shape.triangles_center)[1]
    return {
        "triangles": len(triangles),
        "mean": float(distance.mean()),
        "p95": float(np.quantile(distance, 0.95)),
        "p99": float(np.quantile(distance, 0.99)),
        "largest": float(distance.max()),
        "slivers": int((np.degrees(shape.face_angles.min(axis=1)) < SLIVER).sum()),
        "turned": int(((shape.face_normals * outward).sum(axis=1) < 0).sum()),
        "pieces": mesh.coarse.components.total,
    }


SUBJECT = Subject(
    cases=cases,
    count=3,
    constants={
        "mesh.refinement.refine": ("EDGE_TOLERANCE",),
        "mesh.refinement.edge_growth": (
            "EDGE_HALVINGS",
            "MOST_STRAY",
            "AWAY",
            "LEAN",
            "NEWTON_STEPS",
        ),
        "mesh.refinement.edge_middles": ("OFF_MIDDLE", "JOINS"),
        "mesh.quality": ("POOR", "LEANS", "HIDES", "AGREES", "ENGULFS"),
        "mesh.proxy": ("RELAXATION", "LONGEST_STEP", "LEAST_STEP", "NEWTON_STEPS", "BISECTIONS"),
        "mesh.extraction.cells": ("ROOT_BLOCKS", "CROSSED_MARGIN", "HIDING_MARGIN"),
        "mesh.extraction.loose_pieces": ("LARGE", "NEWTON_STEPS", "LONGEST_STEP"),
        "mesh.extraction.march": ("FROM_ENDS",),
        "mesh.extraction.specks": ("SMALL_PIECE", "SPECK_BORDER", "SPECK_SAMPLES"),
        "mesh.extraction.untangle": (
            *("ROUNDS", "MEANS", "PLACES", "LATER_PLACES", "NEAREST", "FARTHEST", "CALM", "CHANCE"),
            *("THIN", "MOST_TURNED"),
        ),
    },
    ratios=("triangles", "mean", "p95", "p99"),
    highest=("largest",),
    sums=("slivers", "turned", "pieces"),
)
