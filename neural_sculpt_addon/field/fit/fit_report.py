# SPDX-License-Identifier: GPL-3.0-or-later
"""How well a field reproduces the mesh it was fitted to, and what of the mesh it lacks.

Every number is measured on fresh samples, in model space (the shape's longest side is 1.7):

error_mean, error_p95, error_max  distance of points of the mesh to the zero level, by projection
normal_deg                        mean angle between grad f and the mesh's normals there, degrees
sign_errors                       share of the box with the wrong sign, SIGN_CLEARANCE off the mesh
components, cavities              connected pieces of the zero level, and those that face inward
tiny                              those of them that pass between the points of the proxy's lattice
mesh_components, mesh_cavities    the same of the surface that the mesh bounds
lost                              pieces of the mesh that the field has no surface for
allowed, beyond                   the preset's tolerance, and the share of the mesh off by more
thin, thin_off                    share of the mesh with the other side, or another part, nearer
                                  than a cell of the preset's finest level, and of this what is off
worst                             places of the mesh that are off by most, and of the field where
                                  the mesh has nothing; at least APART, the worst first

What an artist should know of it becomes a sentence, with the preset that would do. See
docs/method.md, section 9.
"""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...common.progress import Progress, silent
from ...common.text import Text
from ..evaluate import values
from ..field import Field
from ..geometry import angles, search_tree
from ..levels import spacing
from ..mesh.components import signed_volumes
from ..mesh.proxy import Proxy
from ..projection import ARRIVED, Projection, project
from .fit_detail import FitTolerance
from .fit_repair import Repaired
from .mesh_cleanup import CleanMesh
from .mesh_distance import MeshDistance, MeshSamples
from .mesh_pieces import Pieces, boxes, find_pieces
from .strays import TINY, tiny_places

MEASURED_SAMPLES = 8192  # of the mesh's surface; more measure more steadily, and take longer
VOLUME_SAMPLES = 16384  # in the box, where signs are compared: likewise
SIGN_CLEARANCE = 0.015  # model units from the mesh, within which a sign is not judged
SAMPLES_OF_PIECE = 16  # samples of each piece of the mesh at least,
MOST_PIECES = 2000  # of so many pieces at most
DEPTHS = (0.5, 1.0)  # cells below and above the surface where it is asked whether a part is thin
LOST_OFF = 0.5  # cells, or sizes of a piece, that its samples are off when it is lost
WORST_PLACES, APART = 3, 0.1  # worst places, and model units between them
WOULD_DO = {"normal": "Quality Normal would do.", "fine": "Quality Fine would do."}
SOME = 0.005  # share of the surface that thin parts may be without a word,
MUCH = 0.1  # and that may be off by more than the tolerance


class Presets(NamedTuple):
    """The tolerances of all presets, the coarsest first, and the one that was fitted with."""

    tolerances: Mapping[str, FitTolerance]
    used: str

    @property
    def tolerance(self) -> FitTolerance:
        """The tolerance that counts."""
        return self.tolerances[self.used]

    @property
    def finer(self) -> dict[str, FitTolerance]:
        """The finer tolerances by their presets, the coarsest first."""
        names = list(self.tolerances)
        return {name: self.tolerances[name] for name in names[names.index(self.used) + 1 :]}


class Report(NamedTuple):
    """The measures of the module's docstring, ready for JSON, and sentences."""

    measures: dict[str, Any]
    notes: list[str]


class _Known(NamedTuple):
    """Whether the pieces and cavities of a mesh are known.

    They are not where films across openings, or parts that stick into each other, join pieces and
    close cavities.
    """

    pieces: bool
    cavities: bool


class _Samples(NamedTuple):
    """Points of the mesh, and how far off the zero level is."""

    surface: MeshSamples
    found: Projection
    error: NDArray[np.floating]  # (N,)


def report(
    found: Repaired,
    mesh: CleanMesh,
    distance: MeshDistance,
    presets: Presets,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Report:
    """Quality of the field of `found` against the `mesh`; see the module's docstring."""
    field, proxy = found.field, found.proxy
    progress(0.2, "Measuring the field")
    samples = _measured(field, proxy, distance.surface(MEASURED_SAMPLES, rng))
    volume = rng.uniform(-1, 1, (VOLUME_SAMPLES, 3))
    wrong = volume[(values(field, volume) < 0) != distance.inside(volume)]
    truth = distance(wrong, lambda part, text: progress(0.2 + 0.5 * part, text))
    clear = np.abs(truth.value) > SIGN_CLEARANCE
    progress(0.7, "Comparing pieces")
    pieces = find_pieces(mesh, distance.crossing)
    of_pieces = _measured(field, proxy, _of_pieces(mesh, pieces, distance))
    lost = _lost(mesh, pieces, of_pieces, presets.tolerance)
    solid, cavity = _field_pieces(proxy)
    tiny, hollow = _tiny_pieces(field, proxy)
    solid, cavity = solid + tiny, cavity + hollow
    error = np.concatenate([samples.error, of_pieces.error])
    places = [samples.surface.points, of_pieces.surface.points, found.left.points]
    allowed = presets.tolerance.distance
    thin = _thin(distance, samples, presets.tolerance)
    measures = {
        **deviation(samples.found, samples.surface.points, samples.surface.normals),
        "error_mean": float(samples.error.mean()),
        "error_p95": float(np.percentile(samples.error, 95)),
        "error_max": float(error.max()),
        "sign_errors": float(clear.sum() / len(volume)),
        "components": solid + cavity,
        "cavities": cavity,
        "tiny": tiny + hollow,
        "mesh_components": int(pieces.counted.sum()),
        "mesh_cavities": int(pieces.cavity.sum()),
        "lost": len(lost),
        "uncut": distance.uncut,
        "allowed": allowed,
        "beyond": float((samples.error > allowed).mean()),
        "thin": float(thin.mean()),
        "thin_off": float((thin & (samples.error > allowed)).mean()),
        "worst": worst(np.concatenate(places), np.append(error, found.left.away), allowed),
    }
    is_open = bool(mesh.repairs.get("openings"))
    is_joined = len(np.unique(mesh.pieces)) > len(pieces.solid)
    known = _Known(not is_open, not is_open and not is_joined)

    @cache
    def would() -> list[str]:
        """The finer presets that hold what this one does not."""
        smallest = lost.min(initial=np.inf)
        limit = max(SOME, measures["thin"] / 4)
        return [
            name
            for name, finer in presets.finer.items()
            if spacing(finer.finest) < smallest and _thin(distance, samples, finer).mean() <= limit
        ]

    return Report(measures, _notes(measures, presets, would, mesh.scale, known))


def deviation(found: Projection, points: NDArray, normals: NDArray) -> dict[str, float]:
    """How far the zero level, where it was `found` from them, is from points (N, 3) with normals
    (N, 3): errors and normal_deg."""
    error = np.linalg.norm(found.points - points, axis=1)  # (N,)
    return {
        "error_mean": float(error.mean()),
        "error_p95": float(np.percentile(error, 95)),
        "error_max": float(error.max()),
        "normal_deg": float(angles(found.normals, normals).mean()),
    }


def _measured(field: Field, proxy: Proxy, surface: MeshSamples) -> _Samples:
    """How far off the zero level is: where a projection goes astray, by the proxy's vertices."""
    found = project(field, surface.points)
    error = np.linalg.norm(found.points - surface.points, axis=1)  # (N,)
    lost = found.distance > ARRIVED
    astray = np.flatnonzero(lost | (error > 2 * proxy.active.spacing))
    if len(astray):
        way = search_tree(proxy.vertices).query(surface.points[astray])[0]
        error[astray] = np.where(lost[astray], way, np.minimum(way, error[astray]))
    return _Samples(surface, found, error)


def _of_pieces(mesh: CleanMesh, pieces: Pieces, distance: MeshDistance) -> MeshSamples:
    """Samples of each piece that counts, however small it is."""
    order = np.argsort(pieces.of_faces, kind="stable")
    counts = np.bincount(pieces.of_faces, minlength=len(pieces.solid))
    starts = np.cumsum(counts) - counts
    asked = np.flatnonzero(pieces.counted)
    asked = asked[np.linspace(0, len(asked) - 1, min(len(asked), MOST_PIECES)).astype(int)]
    spread = (np.arange(SAMPLES_OF_PIECE) + 0.5) / SAMPLES_OF_PIECE
    faces = order[(starts[asked, None] + (spread * counts[asked, None]).astype(int)).ravel()]
    corners = mesh.corners[faces]
    points, normal = (
        corners.mean(axis=1),
        np.cross(*(corners[:, 1:] - corners[:, :1]).swapaxes(0, 1)),
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    bounds = distance.facing(points, normal) != 0
    return MeshSamples(points[bounds], normal[bounds], faces[bounds])


def _lost(
    mesh: CleanMesh, pieces: Pieces, samples: _Samples, tolerance: FitTolerance
) -> NDArray[np.floating]:
    """The sizes (L,) of the pieces of the mesh that the field has no surface for."""
    owner = pieces.of_faces[samples.surface.faces]
    low, high = boxes(mesh.corners, pieces.of_faces, len(pieces.solid))
    size = (high - low).max(axis=1)  # (P,)
    cell = spacing(tolerance.finest)
    limit = np.maximum(LOST_OFF * np.minimum(cell, size), tolerance.distance)
    asked = np.unique(owner)
    lost = [piece for piece in asked if np.median(samples.error[owner == piece]) > limit[piece]]
    return size[lost]


def _field_pieces(proxy: Proxy) -> tuple[int, int]:
    """How many pieces face outward and inward."""
    count, labels = proxy.components
    volumes = signed_volumes(proxy.vertices, proxy.triangles, labels, count)
    return int((volumes > 0).sum()), int((volumes <= 0).sum())


def _tiny_pieces(field: Field, proxy: Proxy) -> tuple[int, int]:
    """How many pieces that the proxy's lattice does not see face outward and inward.

    Such a piece is smaller than `TINY` cells, and so its places are less than that apart.
    """
    wide = TINY * proxy.active.spacing
    points = tiny_places(field, proxy)
    pairs = search_tree(points).query_pairs(wide, output_type="ndarray") if len(points) else []
    a, b = np.reshape(pairs, (-1, 2)).T.astype(np.intp)
    links = coo_array((np.ones(len(a)), (a, b)), (len(points), len(points)))
    count, labels = connected_components(links) if len(points) else (0, [])
    first = points[np.unique(labels, return_index=True)[1]]  # (count, 3)
    around = first[:, None] + wide * np.concatenate([np.eye(3), -np.eye(3)])
    outside = values(field, around.reshape(-1, 3)).reshape(-1, 6) > 0
    solid = int((outside.mean(axis=1) > 0.5).sum())
    return solid, count - solid


def _thin(distance: MeshDistance, samples: _Samples, tolerance: FitTolerance) -> NDArray[np.bool_]:
    """Which samples (N,) have the other side, or another part, within a cell."""
    points, normals = samples.surface.points, samples.surface.normals
    turned = np.sum(samples.found.normals * normals, axis=1) < 0  # the mesh's face is flipped
    turned &= samples.error < spacing(tolerance.finest)
    normals = np.where(turned[:, None], -normals, normals)
    thin = np.zeros(len(points), bool)
    for depth in DEPTHS:
        step = depth * spacing(tolerance.finest) * normals
        thin |= ~distance.inside(points - step) | distance.inside(points + step)
    return thin


def worst(
    points: NDArray[np.floating], error: NDArray[np.floating], allowed: float
) -> list[list[float]]:
    """Of points (N, 3), those with the largest errors (N,) beyond what is allowed: at least APART,
    the worst first, ready for JSON."""
    found: list[NDArray[np.floating]] = []
    for index in np.argsort(-error)[: np.count_nonzero(error > allowed)]:
        if all(np.linalg.norm(points[index] - place) > APART for place in found):
            found.append(points[index])
        if len(found) == WORST_PLACES:
            break
    return [[round(float(x), 5) for x in place] for place in found]


def _notes(
    measures: dict[str, Any],
    presets: Presets,
    would: Callable[[], list[str]],
    unit: float,
    known: _Known,
) -> list[str]:
    """Sentences about what the field lacks; lengths in the mesh's `unit`.

    would: the presets that hold it
    """
    inner, mesh_inner = measures["cavities"], measures["mesh_cavities"]
    solid, mesh_solid = measures["components"] - inner, measures["mesh_components"] - mesh_inner
    notes = []
    if solid > mesh_solid or (solid < mesh_solid and known.pieces):
        notes.append(
            Text("The mesh has {} pieces, the field {}. {}", mesh_solid, solid, _advice(would()))
        )
    if inner != mesh_inner and known.cavities:
        notes.append(
            Text("The mesh has {} cavities, the field {}. {}", mesh_inner, inner, _advice(would()))
        )
    if measures["uncut"]:
        notes.append(
            Text(
                "Faces cross in too many places to cut them all ({} are left), so the field may"
                " have walls inside. Unite the parts of the mesh first, with Boolean or Remesh.",
                measures["uncut"],
            )
        )
    if measures["tiny"]:
        notes.append(
            Text(
                "Pieces of the field so small that a proxy may not show them: {}.", measures["tiny"]
            )
        )
    if measures["lost"]:
        notes.append(
            Text(
                "Pieces of the mesh that the field lacks: {}. {}",
                measures["lost"],
                _advice(would()),
            )
        )
    if measures["thin_off"] > SOME:
        notes.append(
            Text(
                "Parts or gaps thinner than {} are off: {} of the surface. {}",
                f"{spacing(presets.tolerance.finest) * unit:.2g}",
                f"{measures['thin_off']:.1%}",
                _advice(would()),
            )
        )
    elif measures["beyond"] > MUCH:
        notes.append(
            Text(
                "Off by more than {}: {} of the surface. {}",
                f"{measures['allowed'] * unit:.2g}",
                f"{measures['beyond']:.0%}",
                _advice(list(presets.finer)[:1]),
            )
        )
    return notes


def _advice(would: list[str]) -> Text:
    """The coarsest preset that would do."""
    if not would:
        return Text("No quality holds that; make such parts larger, or a field of their own.")
    return Text(WOULD_DO[would[0]])
