# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh bounds before it is fitted (docs/method.md, section 5).

Meshes with something wrong on purpose are cleaned, their openings closed, what is inside left out.
"""

from functools import partial

import numpy as np

from neural_sculpt_addon.field.fit.mesh_cleanup import CleanMesh, clean
from neural_sculpt_addon.field.fit.mesh_distance import MeshDistance
from neural_sculpt_addon.field.fit.mesh_open import Open, prepare
from neural_sculpt_addon.field.fit.mesh_pieces import find_pieces
from neural_sculpt_addon.field.geometry import areas

from .solids import SOLIDS, Solid
from .subject import Case, Made, Subject, array_bits

POINTS = 20_000
REACH = 1.3  # half the edge of the box that they are in, mesh units


def cases(count: int, seed: int, more: int) -> list[Case]:
    """The meshes, one after another."""
    solids = list(SOLIDS.values())
    some = [solids[number % len(solids)] for number in range(count)]
    return [partial(_bounded, solid, [seed, number, more]) for number, solid in enumerate(some)]


def _bounded(solid: Solid, seed: list[int]) -> Made:
    kind = Open.SOLID if solid.thickness is None else Open.THICKNESS
    mesh, notes = prepare(clean(*solid.make()), kind, solid.thickness)
    distance = MeshDistance(mesh, np.random.default_rng(seed))
    points = np.random.default_rng(0).uniform(-REACH, REACH, (POINTS, 3))
    inside = distance.inside((points - mesh.center) / mesh.scale)
    pieces = find_pieces(mesh, distance.crossing).counted.sum()
    told = np.frombuffer("".join(map(str, notes)).encode(), np.uint8)
    bits = array_bits(inside, distance.vertices, distance.faces, np.array(pieces), told)
    wrong = int((inside != solid.inside(points)).sum())
    return Made(bits, partial(_measured, mesh, distance, wrong, int(pieces), len(notes)))


def _measured(
    mesh: CleanMesh, distance: MeshDistance, wrong: int, pieces: int, notes: int
) -> dict[str, float]:
    kept = areas(distance.vertices[distance.faces]).sum() / areas(mesh.corners).sum()
    return {"area": float(kept), "wrong_sides": wrong, "pieces": pieces, "notes": notes}


SUBJECT = Subject(
    cases=cases,
    count=len(SOLIDS),
    constants={
        "fit.mesh_cleanup": ("WELD_CELLS", "LEAST_PLACES"),
        "fit.mesh_orient": ("CLOSED", "BULKY"),
        "fit.mesh_winding": ("FAST", "CLOSE", "PROBES_OF_PIECE", "DISSENT"),
        "fit.mesh_open": ("ALIKE", "SHEET", "FEW_SHEETS", "PROPOSED", "WORTH", "SHEET_PROBES"),
        "fit.mesh_thicken": ("SMOOTHED_SHARE", "LONGEST_OFFSET"),
        "fit.mesh_union": (
            *("BESIDE_FACE", "BESIDE_THIN", "PARALLEL", "NEAR_CORNER", "CLOSEST"),
            *("BOTH_INSIDE", "HIDDEN", "WHOLE", "UNCUT_EDGE", "MOST_PAIRS"),
        ),
        "fit.mesh_distance": (
            *("PROBES", "WALLS", "ALL_SHEETS", "SCRAP", "PASSAGE", "INSIDE_OUT"),
        ),
        "fit.mesh_film": (
            "WIDE",
            "MOST_RIM",
            "FILM_CELLS",
            "RIM_RINGS",
            "OFF_MESH",
            "GAP",
            "HALVINGS",
        ),
        "fit.mesh_pieces": ("BURIED_PROBES",),
    },
    ratios=("area",),
    sums=("wrong_sides", "pieces", "notes"),
)
