# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist puts on a proxy, materials, colors, UV maps, groups, is on each next one, too."""

from unittest.mock import patch

import bpy
import numpy as np
from bpy.types import Mesh, Object
from harness import (
    SphereCase,
    arc,
    module,
    push_undo,
    state,
    stroke,
    undo,
    vertices,
)

EDGE = 0.06  # longer than any edge of the proxies here
LEAP = 3.0  # of the UV map at its seam, the plane y = 0


def corners(mesh: Mesh) -> np.ndarray:
    """(F, 3)"""
    flat = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", flat)
    return flat.reshape(-1, 3)


def values(mesh: Mesh, name: str) -> np.ndarray:
    """Of an attribute (N, W)."""
    attribute = mesh.attributes[name]
    member, width, dtype = {
        "FLOAT2": ("vector", 2, np.float32),
        "FLOAT_COLOR": ("color", 4, np.float32),
        "BYTE_COLOR": ("color_srgb", 4, np.float32),
        "INT": ("value", 1, np.int32),
        "BOOLEAN": ("value", 1, np.bool_),
    }[attribute.data_type]
    flat = np.empty(len(attribute.data) * width, dtype)
    attribute.data.foreach_get(member, flat)
    return flat.reshape(-1, width)


def put(mesh: Mesh, name: str, kind: str, domain: str, given: np.ndarray) -> None:
    member = {"FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color_srgb"}
    if name not in mesh.attributes:
        mesh.attributes.new(name, kind, domain)
    data = mesh.attributes[name].data
    data.foreach_set(member.get(kind, "value"), np.ascontiguousarray(given).ravel())


def weights(ob: Object, name: str) -> np.ndarray:
    """Of a vertex group (V,), -1 where a vertex is in none."""
    index = ob.vertex_groups[name].index
    found = [[e.weight for e in v.groups if e.group == index] for v in ob.data.vertices]
    return np.array([each[0] if each else -1.0 for each in found])


def decorate(ob: Object) -> None:
    """As an artist may: above is the second material; the map is flat from the front, and from the
    back, beside that; colors tell the place, or on which side a face is."""
    mesh, points = ob.data, vertices(ob)
    triangles = corners(mesh)
    middles = points[triangles].mean(axis=1)
    for name in ("Clay", "Iron"):
        mesh.materials.append(bpy.data.materials.new(name))
    put(mesh, "material_index", "INT", "FACE", (middles[:, 2] > 0).astype(np.int32))
    back = np.where(middles[:, 1] > 0, LEAP, 0)[:, None]
    uv = points[triangles][:, :, [0, 2]].astype(np.float32)  # (F, 3, 2)
    uv[:, :, 0] += back
    put(mesh, "Front", "FLOAT2", "CORNER", uv)
    put(mesh, "Other", "FLOAT2", "CORNER", 0.25 * uv)
    put(mesh, "Place", "FLOAT_COLOR", "POINT", colors(points))
    side = np.where(middles[:, :1] > 0, [1, 0, 0, 1], [0, 0, 1, 1]).astype(np.float32)
    put(mesh, "Side", "BYTE_COLOR", "CORNER", np.repeat(side, 3, axis=0))
    mesh.uv_layers.active_index = mesh.uv_layers.find("Other")
    mesh.uv_layers["Front"].active_render = True
    mesh.attributes.active_color_name, mesh.attributes.default_color_name = "Side", "Place"
    ob.vertex_groups.new(name="Empty")
    high, all_ = ob.vertex_groups.new(name="High"), ob.vertex_groups.new(name="All")
    for i, z in enumerate(points[:, 2].tolist()):
        if z >= 0:
            high.add([i], min(z, 1.0), "REPLACE")
    all_.add(range(0, len(points)), 0.5, "REPLACE")
    all_.lock_weight = True
    ob.vertex_groups.active_index = 1


def colors(points: np.ndarray) -> np.ndarray:
    """(V, 4), three times as much as there is to be seen in red."""
    return np.c_[3 * points[:, 0], points[:, 1:], np.ones(len(points))].astype(np.float32)


class Carried(SphereCase):
    def mesh(self) -> Mesh:
        return self.ob().data

    def sculpt(self, tilt: float = 0.0) -> None:
        stroke(arc(self.ob(), tilt=tilt), radius=0.15, intensity=0.06)

    def everything(self) -> tuple[object, ...]:
        """All that undo must bring back."""
        ob, mesh = self.ob(), self.mesh()
        named = ("Front", "Other", "Place", "Side", "material_index")
        kept = {name: values(mesh, name).tobytes() for name in named if name in mesh.attributes}
        groups = {g.name: (weights(ob, g.name).tobytes(), g.lock_weight) for g in ob.vertex_groups}
        return state(ob), kept, groups

    def check(self, edge: float = EDGE) -> None:
        """All is where `decorate` put it, at the closest point of the sphere, beside which the one
        of its facets is by less than a quarter of their edges."""
        ob, mesh, gap = self.ob(), self.mesh(), edge / 4
        points, triangles = vertices(ob), corners(mesh)
        there = self.size * points / np.linalg.norm(points, axis=1, keepdims=True)
        middles = points[triangles].mean(axis=1)
        self.assertEqual([m.name for m in mesh.materials], ["Clay", "Iron"])
        x, y, z = middles.T
        index = values(mesh, "material_index")[:, 0]
        self.assertTrue((index[z > edge] == 1).all() and (index[z < -edge] == 0).all())
        uv = values(mesh, "Front").reshape(-1, 3, 2)
        back = uv[:, :, 0].mean(axis=1) > LEAP / 2
        self.assertTrue(back[y > edge].all() and not back[y < -edge].any())
        uv[:, :, 0] -= LEAP * back[:, None]
        off = np.abs(uv - there[triangles][:, :, [0, 2]]).max(axis=(1, 2))
        self.assertLess(off[np.abs(y) > edge].max(), gap)
        self.assertLess(off.max(), edge)  # at the seam; a face across it would be off by 3
        place = values(mesh, "Place")
        self.assertLess(np.abs(place - colors(there)).max(), 3 * gap)
        side = values(mesh, "Side").reshape(-1, 3, 4)
        self.assertTrue((side[x > edge] == [1, 0, 0, 1]).all())
        self.assertTrue((side[x < -edge] == [0, 0, 1, 1]).all())
        self.assertEqual(
            set(map(tuple, side.reshape(-1, 4).tolist())), {(1, 0, 0, 1), (0, 0, 1, 1)}
        )
        self.assertEqual([g.name for g in ob.vertex_groups], ["Empty", "High", "All"])
        self.assertEqual([g.lock_weight for g in ob.vertex_groups], [False, False, True])
        self.assertEqual(ob.vertex_groups.active_index, 1)
        high, z = weights(ob, "High"), there[:, 2]
        self.assertLess(np.abs(high[z > edge] - z[z > edge]).max(), gap)
        self.assertTrue((high[z < -edge] == -1).all())
        self.assertTrue((weights(ob, "All") == 0.5).all())
        self.assertTrue((weights(ob, "Empty") == -1).all())
        self.assertEqual(mesh.uv_layers.active.name, "Other")
        self.assertTrue(mesh.uv_layers["Front"].active_render)
        self.assertEqual(mesh.attributes.active_color_name, "Side")
        self.assertEqual(mesh.attributes.default_color_name, "Place")

    def test_all_is_carried_and_undo_brings_back_all(self) -> None:
        decorate(self.ob())
        push_undo("Decorate")
        self.check()
        states = [self.everything()]
        count = len(vertices(self.ob()))
        for tilt in (0.0, 0.5):
            self.sculpt(tilt)
            self.check()
            states.append(self.everything())
        self.assertNotEqual(len(vertices(self.ob())), count)
        self.undo_and_redo(states, self.everything)

    def test_what_is_left_alone_keeps_its_values_bit_for_bit(self) -> None:
        """Values that no neighbour shares, at each corner, after two strokes."""
        mesh, triangles, points = self.mesh(), corners(self.mesh()), vertices(self.ob())
        random = np.random.default_rng(3)
        given = {
            "Map": ("FLOAT2", "CORNER", random.random((3 * len(triangles), 2))),
            "Bytes": (
                "BYTE_COLOR",
                "CORNER",
                random.integers(256, size=(3 * len(triangles), 4)) / 255,
            ),
            "Color": ("FLOAT_COLOR", "POINT", random.random((len(points), 4))),
        }
        for name, (kind, domain, some) in given.items():
            put(mesh, name, kind, domain, some.astype(np.float32))
        group = self.ob().vertex_groups.new(name="Group")
        for i, weight in enumerate(random.random(len(points)).tolist()):
            group.add([i], weight, "REPLACE")
        states = [self.at_places()]
        for tilt in (0.0, 0.4):
            self.sculpt(tilt)
            states.append(self.at_places())
        for first, second, third in zip(*states, strict=True):
            same = first.keys() & second.keys() & third.keys()
            self.assertGreater(len(same), 0.5 * len(first))
            self.assertEqual({p for p in same if not first[p] == second[p] == third[p]}, set())

    def at_places(self) -> tuple[dict[object, object], dict[object, object]]:
        """The values of vertices, and of corners, by their places."""
        mesh, points = self.mesh(), vertices(self.ob())
        group, color = weights(self.ob(), "Group").tolist(), values(mesh, "Color").tolist()
        uv, side = values(mesh, "Map").tolist(), values(mesh, "Bytes").tolist()
        place = [tuple(p) for p in points.tolist()]
        of_vertices = {p: (w, tuple(c)) for p, w, c in zip(place, group, color, strict=True)}
        of_corners: dict[object, object] = {}
        for face, triangle in enumerate(corners(mesh).tolist()):
            for k, vertex in enumerate(triangle):
                key = place[vertex], frozenset(place[v] for v in triangle)
                of_corners[key] = tuple(uv[3 * face + k]), tuple(side[3 * face + k])
        return of_vertices, of_corners

    def test_what_is_painted_between_strokes_counts(self) -> None:
        self.sculpt()
        decorate(self.ob())
        mesh = self.mesh()
        put(
            mesh,
            "Place",
            "FLOAT_COLOR",
            "POINT",
            np.tile(np.float32([0, 1, 0, 1]), (len(mesh.vertices), 1)),
        )
        self.sculpt(0.5)
        self.assertTrue((values(self.mesh(), "Place") == [0, 1, 0, 1]).all())
        self.mesh().attributes.remove(self.mesh().attributes["Place"])
        self.ob().vertex_groups.remove(self.ob().vertex_groups["High"])
        self.sculpt(-0.5)
        self.assertNotIn("Place", self.mesh().attributes)
        self.assertEqual([g.name for g in self.ob().vertex_groups], ["Empty", "All"])

    def test_a_finer_and_a_coarser_proxy_have_it_too(self) -> None:
        decorate(self.ob())
        for resolution, edge in ((80, EDGE), (32, 1.5 * EDGE)):
            bpy.ops.neural_sculpt.remesh(resolution=resolution)
            self.check(edge)

    def test_what_other_brushes_did_leaves_it(self) -> None:
        """A hill that is pulled out of the sphere along its radii becomes a layer."""
        decorate(self.ob())
        push_undo("Decorate")
        states, mesh, moved = [self.everything()], self.mesh(), vertices(self.ob())
        near = np.linalg.norm(moved - moved[np.argmin(moved[:, 1])], axis=1)
        moved *= (1 + 0.1 * np.exp(-((near / 0.2) ** 2)))[:, None]
        mesh.attributes["position"].data.foreach_set("vector", moved.ravel())
        mesh.update()
        push_undo("Grab")
        states.append(self.everything())
        bpy.ops.neural_sculpt.absorb()
        self.assertEqual(len(self.ob().neural_sculpt.strokes), 1)
        self.assertFalse(np.array_equal(vertices(self.ob()), moved))
        self.check(1.3 * EDGE)
        states.append(self.everything())
        self.undo_and_redo(states, self.everything)

    def test_in_sculpt_mode_and_while_it_is_painted(self) -> None:
        decorate(self.ob())
        push_undo("Decorate")
        for mode in ("SCULPT", "VERTEX_PAINT", "WEIGHT_PAINT"):
            bpy.ops.object.mode_set(mode=mode)
            self.sculpt()
            bpy.ops.object.mode_set(mode="OBJECT")
            self.check()
            undo()

    def test_faces_of_any_kind_are_read(self) -> None:
        """After a voxel remesh, say: quads, of which each has one material and four corners."""
        decorate(self.ob())
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.tris_convert_to_quads(materials=True, uvs=True)
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertLess(len(self.mesh().polygons), len(self.mesh().loops) / 3 - 500)
        bpy.ops.neural_sculpt.remesh(resolution=48)
        self.check()

    def test_a_result_waits_until_all_is_found_and_needs_little_then(self) -> None:
        """In a window: in steps, and again where the artist changed something meanwhile."""
        next_proxy, sources = (
            module("blender.scene.next_proxy"),
            module("blender.scene.mesh.sources"),
        )
        decorate(self.ob())
        push_undo("Decorate")
        prepare, answers, searched = next_proxy.prepare, [], []
        steps = sources.Sources.steps

        def watched(ob: Object, result: object, smooth: bool) -> bool:
            answers.append(prepare(ob, result, smooth))
            if len(answers) == 3:
                group = ob.vertex_groups["All"]
                group.add(range(0, len(ob.data.vertices)), 0.75, "REPLACE")
                push_undo("Paint")
            return answers[-1]

        def counted(self: object, *given: object) -> object:
            searched.append(self)
            return steps(self, *given)

        with (
            self.as_in_a_window(),
            patch.object(next_proxy, "prepare", watched),
            patch.object(sources.Sources, "steps", counted),
        ):
            bpy.ops.neural_sculpt.remesh(resolution=64)
            self.finish()
        self.assertEqual(answers, [True] * (len(answers) - 1) + [False])
        self.assertTrue((weights(self.ob(), "All") == 0.75).all())
        self.assertLessEqual(len(searched), 2)  # what was found is used

    def test_where_there_is_nothing_nothing_is_looked_for(self) -> None:
        self.mesh().materials.append(bpy.data.materials.new("Clay"))
        sources = module("blender.scene.mesh.sources")
        with patch.object(sources.MeshSurface, "of", side_effect=AssertionError):
            self.sculpt()
        self.assertEqual(len(self.ob().neural_sculpt.strokes), 1)
