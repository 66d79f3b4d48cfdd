# SPDX-License-Identifier: GPL-3.0-or-later
"""Awkward meshes, each with what a fit of it must come to or say.

What is wrong or small here is so on purpose: openings, cavities, walls within, parts thinner than a
cell, coordinates without digits. An `Awkward` says in words what is expected, and as numbers what
can be checked: pieces and cavities of the field, a sentence that must come, or the refusal.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import trimesh

from .damaged_meshes import Mesh, crowd, doubled, far, holes, joined, mixed, noisy, sheet, soup

BALL = 4  # subdivisions


@dataclass(frozen=True)
class Awkward:
    """A mesh and what is expected of it.

    pieces, cavities: of the field, None when a sentence must say how they differ from the mesh's
    says:             parts of sentences that must come, all of them
    refused:          part of the sentence that refuses it, empty when it must be fitted
    error:            largest mean error that needs no sentence, model space
    """

    expected: str
    make: Callable[[], Mesh]
    pieces: int | None = 1
    cavities: int | None = 0
    says: tuple[str, ...] = ()
    refused: str = ""
    error: float = 1e-3
    options: Mapping[str, Any] = field(default_factory=dict)

    def silent(self) -> dict[str, float]:
        """The measures that may be no larger without a sentence."""
        return {"error_mean": self.error, "sign_errors": 0.002, "lost": 0}


def ball(radius: float, way: int = 1, at: tuple[float, ...] = (0, 0, 0), fine: int = BALL) -> Mesh:
    """A sphere; its faces look inward with -1."""
    mesh = trimesh.creation.icosphere(fine, radius)
    return mesh.vertices + at, mesh.faces[:, ::way]


def box(size: tuple[float, ...], at: tuple[float, ...] = (0, 0, 0)) -> Mesh:
    """A box of twelve triangles."""
    mesh = trimesh.creation.box(size)
    return mesh.vertices + at, mesh.faces


def rods(width: float) -> Mesh:
    """Seven of them, side by side."""
    return joined(*(box((1.7, width, width), (0, 0.1 * i, 0)) for i in range(7)))


def cylinder(lids: int) -> Mesh:
    """An upright cylinder with both lids, the lower one, or none."""
    mesh = trimesh.creation.cylinder(0.5, 1.5, sections=48)
    up = mesh.face_normals[:, 2]
    gone = (lids < 2) & (up > 0.9) | (lids < 1) & (up < -0.9)
    return mesh.vertices, mesh.faces[~gone]


def part_of_ball(lowest: float) -> Mesh:
    """A sphere without what lies below."""
    vertices, faces = ball(1)
    return vertices, faces[vertices[faces].mean(axis=1)[:, 2] > lowest]


def vase() -> Mesh:
    """A turned vase, open above."""
    line = [[0, 0], [0.4, 0], [0.55, 0.5], [0.3, 1.0], [0.35, 1.3]]
    mesh = trimesh.creation.revolve(np.array(line), sections=64)
    return mesh.vertices, mesh.faces


def car() -> Mesh:
    """A body whose floor is open, and four wheels."""
    body = trimesh.creation.box((4, 1.6, 1.2)).subdivide()
    floor = body.face_normals[:, 2] < -0.9
    wheels = [ball(0.25, 1, (x, y, -0.7), 2) for x in (-1.2, 1.2) for y in (-0.7, 0.7)]
    return joined((body.vertices, body.faces[~floor]), *wheels)


def fin() -> Mesh:
    """A sphere with a triangle that stands on it."""
    triangle = np.array([[0, 0, 0.9], [0.3, 0, 1.3], [-0.3, 0, 1.3]]), np.array([[0, 1, 2]])
    return joined(ball(1), triangle)


def klein_bottle() -> Mesh:
    """The figure-8 immersion of a Klein bottle, which passes through itself."""
    n, m = 96, 48
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    r = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), z], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")

    def at(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        turned = np.where(i == n, -j % m, j % m)  # the seam joins v to -v
        return (i % n) * m + turned

    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return vertices, faces


def text() -> Mesh:
    """The word FIT of boxes that stick into each other."""
    stem = [box((0.1, 0.1, 0.8), (x, 0, 0)) for x in (0, 0.7, 1.2)]
    arms = [box((0.4, 0.1, 0.1), (0.15, 0, 0.35)), box((0.3, 0.1, 0.1), (0.1, 0, 0.05))]
    return joined(*stem, *arms, box((0.6, 0.1, 0.1), (1.2, 0, 0.35)))


def engraved() -> Mesh:
    """A plate with grooves narrower than a cell."""
    slabs = [box((1.6, 1.0, 0.2))]
    slabs += [box((1.6, 0.05, 0.1), (0, -0.475 + 0.055 * i, 0.12)) for i in range(18)]
    return joined(*slabs)


def chain() -> Mesh:
    """Three links that hang in each other."""
    links = []
    for number in range(3):
        link = trimesh.creation.torus(0.3, 0.07, major_sections=64, minor_sections=32)
        if number % 2:
            link.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
        link.apply_translation([0.42 * number, 0, 0])
        links.append((np.array(link.vertices), np.array(link.faces)))
    return joined(*links)


def eighty() -> Mesh:
    """Boxes of random place, most of which stick into each other."""
    rng = np.random.default_rng(4)
    return joined(
        *(box(tuple(rng.uniform(0.2, 0.5, 3)), tuple(rng.uniform(-0.5, 0.5, 3))) for _ in range(80))
    )


def faceted() -> Mesh:
    """A detailed sphere: waves finer than the normal preset's cells."""
    vertices, faces = ball(1, fine=6)
    waves = np.prod(np.sin(70 * vertices), axis=1)
    return vertices * (1 + 0.02 * waves[:, None]), faces


def suzanne() -> Mesh:
    """The ready-made field's surface, with waves."""
    from neural_sculpt_addon.field.mesh.proxy import extract
    from neural_sculpt_addon.field.primitives import primitive

    proxy = extract(primitive("suzanne"), 200)
    waves = np.sin(50 * proxy.vertices).prod(axis=1)
    return proxy.vertices + 0.01 * waves[:, None] * proxy.normals, proxy.triangles


def single(mesh: Mesh) -> Mesh:
    """The mesh in float32."""
    return mesh[0].astype(np.float32), mesh[1]


def damaged(damage: Callable[..., Mesh]) -> Mesh:
    """A sphere after one of the damages."""
    return damage(*ball(1), np.random.default_rng(0))


def blocks() -> Mesh:
    """Cubes that touch, each fifth inside out, with their sides divided this way or that."""
    rng = np.random.default_rng(0)
    cubes = []
    for number, place in enumerate(np.ndindex(3, 3, 3)):
        turn = trimesh.transformations.rotation_matrix(np.pi / 2, np.eye(3)[rng.integers(3)])
        cube = trimesh.creation.box((1, 1, 1)).apply_transform(turn)
        way = -1 if number % 5 == 4 else 1
        cubes.append((cube.vertices + place, cube.faces[:, ::way]))
    return joined(*cubes)


def unsewn() -> Mesh:
    """A box whose top is divided more finely than its sides, with triangles that have no area in
    the seams."""
    fine, box = trimesh.creation.box((1, 1, 1)).subdivide(), trimesh.creation.box((1, 1, 1))
    top = fine.faces[fine.triangles_center[:, 2] > 0.49]
    rest = box.faces[box.triangles_center[:, 2] < 0.49]
    whole = joined((fine.vertices, top), (box.vertices, rest))
    rim = [[x, y, 0.5] for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    middles = (np.array(rim) + np.roll(rim, -1, axis=0)) / 2
    corners = np.stack([rim, np.roll(rim, -1, axis=0), middles], axis=1).reshape(-1, 3)
    return joined(whole, (corners, np.arange(12).reshape(-1, 3)))


def bars() -> Mesh:
    """A slab with 210 bars through it: thousands of faces cross."""
    places = [(x, y, 0) for x in np.linspace(-0.9, 0.9, 15) for y in np.linspace(-0.9, 0.9, 14)]
    return joined(box((2, 2, 0.1)), *(box((0.06, 0.06, 0.4), place) for place in places))


THICK = {"open_parts": "thickness"}
FILM = "Openings closed by a film"

AWKWARD: dict[str, Awkward] = {
    "hollow sphere": Awkward("the cavity stays", lambda: joined(ball(1), ball(0.6, -1)), 1, 1),
    "three shells": Awkward(
        "a ball in a hollow ball", lambda: joined(ball(1), ball(0.7, -1), ball(0.4)), 2, 1
    ),
    "inside out": Awkward("as the right way round", lambda: joined(ball(1, -1), ball(0.6)), 1, 1),
    "ball in a ball": Awkward("the inner walls go", lambda: joined(ball(1), ball(0.4))),
    "three boxes": Awkward(
        "one piece, without walls",
        lambda: joined(*(box((1, 0.3, 0.3), (0.3 * i, 0.1 * i, 0.1 * i)) for i in range(3))),
    ),
    "eighty boxes": Awkward("their union", eighty, None, None),
    "duplicate parts": Awkward("one of them", lambda: joined(ball(1), ball(1))),
    "duplicate, moved": Awkward("their union", lambda: joined(ball(1), ball(1, 1, (0.001, 0, 0)))),
    "stacked boxes": Awkward(
        "one piece", lambda: joined(box((1, 1, 0.5)), box((1, 1, 0.5), (0, 0, 0.5)))
    ),
    "copy inside out": Awkward(
        "one of them", lambda: joined(box((1, 1, 1)), (-box((1, 1, 1))[0], box((1, 1, 1))[1]))
    ),
    "touching blocks": Awkward("one piece", blocks),
    "closet": Awkward(
        "the cavity stays, though it touches the wall",
        lambda: joined(
            box((1, 1, 1)), (box((0.5, 0.5, 0.5), (0, 0, 0.25))[0], box((1, 1, 1))[1][:, ::-1])
        ),
    ),
    "seams": Awkward("sewn", unsewn, options=THICK),
    "slab with bars": Awkward("their union", bars),
    "half sphere": Awkward("filled, with a word", lambda: part_of_ball(0), says=(FILM,)),
    "half sphere, shell": Awkward("a shell", lambda: part_of_ball(0), options=THICK, says=("got",)),
    "cup": Awkward("filled, with a word", lambda: cylinder(1), says=(FILM,)),
    "cup, thick": Awkward("one piece", lambda: cylinder(1), options=THICK, says=("got a thick",)),
    "tube": Awkward("filled, with a word", lambda: cylinder(0), says=(FILM,)),
    "tube, thick": Awkward("a ring", lambda: cylinder(0), options=THICK, says=("got a thick",)),
    "vase": Awkward("filled, with a word", vase, says=(FILM,)),
    "vase, thick": Awkward("one piece", vase, options=THICK, says=("got a thickness",)),
    "car body": Awkward("filled, with a word; no sheet", car, says=(FILM,)),
    "sphere and fin": Awkward("the fin is thick, with a word", fin, says=("Open sheets",)),
    "sheet": Awkward("refused, the choice named", sheet, refused="Open Parts"),
    "sheet, thick": Awkward("a plate", sheet, options=THICK, says=("got a thickness",)),
    "solid beside sheet": Awkward(
        "refused, the choice named",
        lambda: joined(ball(1), (sheet()[0] + [0, 0, 1.5], sheet()[1])),
        refused="A part of",
    ),
    "open and closed": Awkward(
        "both, the opening named",
        lambda: joined(ball(0.5), (cylinder(1)[0] + [2, 0, 0], cylinder(1)[1])),
        2,
        says=(FILM,),
    ),
    "rods of 0.015": Awkward("7 pieces, or a word", lambda: rods(0.015), None, says=("Fine",)),
    "rods of 0.06": Awkward("7 pieces", lambda: rods(0.06), 7),
    "thin plate": Awkward("a plate", lambda: box((1.7, 1.2, 0.04))),
    "thinnest plate": Awkward(
        "named as too thin", lambda: box((1.7, 1.2, 0.003)), None, None, says=("thinner than",)
    ),
    "narrow gap": Awkward(
        "the gap is named",
        lambda: joined(box((1, 1, 1)), box((1, 1, 1), (1.004, 0, 0))),
        None,
        None,
        says=("2 pieces", "thinner than"),
    ),
    "grooves": Awkward("grooves are named", engraved, None, None, says=("thinner than",)),
    "tiny beside huge": Awkward(
        "the lost one is named",
        lambda: joined(ball(1), ball(0.003, 1, (1.2, 0, 0), 1)),
        None,
        says=("lacks: 1.",),
    ),
    "small beside huge": Awkward("both", lambda: joined(ball(1), ball(0.05, 1, (1.2, 0, 0), 2)), 2),
    "text": Awkward("three letters", text, 3),
    "chain": Awkward("three links", chain, 3),
    "Klein bottle": Awkward("a solid, or a refusal that says why", klein_bottle, None, None),
    "detailed sphere": Awkward("Fine is named", faceted, None, None, says=("Fine would do",)),
    "detailed Suzanne": Awkward("she, or Fine is named", suzanne, None, None),
    "holes": Awkward("closed", lambda: damaged(holes)),
    "soup": Awkward("welded and turned", lambda: damaged(soup)),
    "mixed winding": Awkward("turned", lambda: damaged(mixed)),
    "doubled faces": Awkward("dropped", lambda: damaged(doubled)),
    "noisy": Awkward("as it is", lambda: damaged(noisy), None, None),
    "crowd of eight": Awkward("eight pieces", lambda: damaged(crowd), 8),
    "far away, double": Awkward("as near by", lambda: damaged(far)),
    "far away, single": Awkward(
        "refused: no digits are left",
        lambda: single((ball(1)[0] + 1e6, ball(1)[1])),
        refused="far from its origin",
    ),
    "NaN": Awkward(
        "refused",
        lambda: (np.where(ball(1)[0] > 0.99, np.nan, ball(1)[0]), ball(1)[1]),
        refused="no finite position",
    ),
}
