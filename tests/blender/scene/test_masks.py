# SPDX-License-Identifier: GPL-3.0-or-later
"""What is masked or hidden on a proxy: strokes leave it alone, and every new proxy has it, too."""

import json
import unittest
from unittest.mock import patch

import bpy
import numpy as np
from bpy.types import Object
from geometry import square, to_path
from harness import (
    SphereCase,
    arc,
    brush_settings,
    long,
    module,
    state,
    stroke,
    strokes_of,
    undo,
    vertices,
)

attributes = module("blender.scene.mesh.brush_attributes")
nearest = module("interaction.nearest_points").nearest
Stroke = module("stroke.stroke").Stroke
Mask = module("stroke.mask").Mask

EDGE = 0.06  # longer than any edge of the proxies here
NEW_EDGES = 0.07  # and so long for the surface to change from masked to free


def faces(ob: Object) -> np.ndarray:
    """(F, 3)"""
    flat = np.empty(len(ob.data.loops), np.int32)
    ob.data.loops.foreach_get("vertex_index", flat)
    return flat.reshape(-1, 3)


def painted(ob: Object) -> dict[str, np.ndarray]:
    return attributes.read(ob.data)


def paint(ob: Object, masks: np.ndarray) -> None:
    """As the mask brush does."""
    mesh = ob.data
    if ".sculpt_mask" not in mesh.attributes:
        mesh.attributes.new(".sculpt_mask", "FLOAT", "POINT")
    mesh.attributes[".sculpt_mask"].data.foreach_set("value", np.asarray(masks, np.float32))


def half(ob: Object) -> np.ndarray:
    """A mask (V,) of the right half."""
    return (vertices(ob)[:, 0] > 0).astype(np.float32)


def middles(ob: Object) -> np.ndarray:
    """(F, 3)"""
    return vertices(ob)[faces(ob)].mean(axis=1)


class Masks(SphereCase):
    def raised(self) -> np.ndarray:
        """By how much each vertex lies outside of the sphere (V,)."""
        return np.linalg.norm(vertices(self.ob()), axis=1) - self.size

    def sculpt(self, **given: object) -> None:
        stroke(self.line, radius=0.15, intensity=0.06, **given)

    def everything(self) -> tuple[object, ...]:
        """All that undo must bring back."""
        kept = {name: values.tobytes() for name, values in painted(self.ob()).items()}
        return state(self.ob()), kept

    def test_what_is_masked_stays_and_the_rest_is_as_without_a_mask(self) -> None:
        self.sculpt()
        free = vertices(self.ob()), self.raised()
        undo()
        paint(self.ob(), half(self.ob()))
        self.sculpt()
        x, raised = vertices(self.ob())[:, 0], self.raised()
        self.assertLess(np.abs(raised[x > EDGE]).max(), 2e-4)  # the network's own sphere
        beside = x < -NEW_EDGES
        self.assertGreater(raised[beside].max(), 0.059)
        source = nearest(vertices(self.ob())[beside], free[0])
        away = np.linalg.norm(vertices(self.ob())[beside] - free[0][source], axis=1)
        same = away < 1e-4  # vertices slide where the lattice finds others
        self.assertGreater(same.mean(), 0.9)
        np.testing.assert_allclose(raised[beside][same], free[1][source][same], atol=2e-4)

    def test_a_mask_in_between_weakens(self) -> None:
        paint(self.ob(), np.full(len(vertices(self.ob())), 0.25))
        self.sculpt()
        self.assertAlmostEqual(float(self.raised().max()), 0.75 * 0.06, delta=5e-4)

    def test_what_was_cleared_is_not_written_back(self) -> None:
        """Clear Mask takes the attribute away, and an undo of the brush stroke before brings it."""
        paint(self.ob(), half(self.ob()))
        self.ob().data.polygons.foreach_set("hide", middles(self.ob())[:, 1] > 0)
        mesh = self.ob().data
        mesh.attributes.remove(mesh.attributes[".sculpt_mask"])
        kept = painted(self.ob())
        paint(self.ob(), half(self.ob()))
        attributes.write(self.ob().data, kept)
        self.assertEqual(set(painted(self.ob())), set(kept))
        for name, values in painted(self.ob()).items():
            np.testing.assert_array_equal(values, kept[name])

    def test_the_new_proxy_has_the_mask_and_undo_brings_back_all(self) -> None:
        masks = np.clip(0.5 + vertices(self.ob())[:, 0] / 0.4, 0, 1)
        paint(self.ob(), masks)
        module("blender.scene.undo_step").push_undo("Mask")
        before, points = self.everything(), vertices(self.ob())
        states = [before]
        for tilt in (0.0, 0.4, -0.4):
            self.line = arc(self.ob(), tilt=tilt)
            self.sculpt()
            states.append(self.everything())
        mask = painted(self.ob())[".sculpt_mask"]
        now = vertices(self.ob())
        self.assertNotEqual(len(now), len(points))
        expected = np.clip(0.5 + now[:, 0] / 0.4, 0, 1)
        self.assertLess(np.abs(mask - expected).max(), EDGE / 0.4 + 0.06 / 0.4)
        place = {tuple(p): m for p, m in zip(points.tolist(), masks.tolist(), strict=True)}
        kept = [
            (m, place[tuple(p)])
            for p, m in zip(now.tolist(), mask.tolist(), strict=True)
            if tuple(p) in place
        ]
        self.assertGreater(len(kept), len(now) / 2)
        for ours, theirs in kept:
            self.assertAlmostEqual(ours, theirs, places=6)
        self.undo_and_redo(states, self.everything)

    @long
    def test_a_sharp_border_stays_sharp_under_many_strokes(self) -> None:
        paint(self.ob(), half(self.ob()))
        for tilt in (0.0, 0.2, 0.4):
            self.line = arc(self.ob(), tilt=tilt)
            self.sculpt()
        mask, x = painted(self.ob())[".sculpt_mask"], vertices(self.ob())[:, 0]
        self.assertEqual(set(mask.tolist()), {0.0, 1.0})
        self.assertTrue((mask[x > EDGE] == 1).all())
        self.assertTrue((mask[x < -EDGE] == 0).all())

    @long
    def test_the_history_comes_to_the_same_whatever_is_masked_later(self) -> None:
        paint(self.ob(), half(self.ob()))
        self.sculpt()
        made = self.ob().neural_sculpt.strokes[0].layer_id  # of the layer's bytes
        text = json.dumps({"version": 1, "strokes": strokes_of(self.ob())})
        self.assertLess(len(text), 10_000)
        paint(self.ob(), 0 * half(self.ob()))
        bpy.ops.neural_sculpt.edit_stroke(radius=0.1)
        self.assertNotEqual(self.ob().neural_sculpt.strokes[0].layer_id, made)
        self.session.stop()  # which remembers what it solved
        bpy.ops.neural_sculpt.edit_stroke(radius=0.15)
        self.assertEqual(self.ob().neural_sculpt.strokes[0].layer_id, made)
        bpy.ops.neural_sculpt.delete_stroke()
        bpy.ops.neural_sculpt.stroke(stroke_json=text)
        self.assertEqual(self.ob().neural_sculpt.strokes[0].layer_id, made)
        bpy.ops.neural_sculpt.delete_stroke()
        self.sculpt()
        self.assertNotIn("mask", strokes_of(self.ob())[0])
        self.assertNotEqual(self.ob().neural_sculpt.strokes[0].layer_id, made)

    def test_a_stroke_can_be_given_what_is_masked_now(self) -> None:
        self.sculpt()
        paint(self.ob(), half(self.ob()))
        bpy.ops.neural_sculpt.edit_stroke(mask="NOW")
        x = vertices(self.ob())[:, 0]  # the mask lies where the stroke was, and its border is wider
        far = x > NEW_EDGES
        place = vertices(self.ob())[far]
        place *= self.size / np.linalg.norm(place, axis=1, keepdims=True)
        mask = Stroke.from_json(strokes_of(self.ob())[0]).mask(place)
        left = 0.06 * (1 - mask) + 2e-4
        allowed = np.minimum(left, 2e-3)  # far from the stroke nothing is masked
        self.assertTrue((np.abs(self.raised()[far]) < allowed).all())
        self.assertGreater(self.raised().max(), 0.05)
        paint(self.ob(), 0 * half(self.ob()))
        bpy.ops.neural_sculpt.edit_stroke(mask="NOW")
        self.assertNotIn("mask", strokes_of(self.ob())[0])

    def test_the_next_stroke_is_not_offered_what_this_one_was_given(self) -> None:
        """Blender remembers what a dialog was given, but of such properties."""
        operator = bpy.ops.neural_sculpt.edit_stroke.get_rna_type()
        self.assertTrue(operator.properties["mask"].is_skip_save)

    def test_hidden_faces_stay_and_stay_hidden(self) -> None:
        hidden = middles(self.ob())[:, 0] > 0
        self.ob().data.polygons.foreach_set("hide", hidden)
        self.sculpt()
        hidden, x = painted(self.ob())[".hide_poly"], middles(self.ob())[:, 0]
        self.assertTrue(hidden[x > EDGE].all())
        self.assertFalse(hidden[x < -EDGE].any())
        corners = faces(self.ob())
        self.assertLess(np.abs(self.raised()[corners[hidden]]).max(), 3e-4)
        self.assertGreater(self.raised().max(), 0.059)
        shown = np.zeros(len(vertices(self.ob())), bool)
        shown[corners[~hidden]] = True
        np.testing.assert_array_equal(painted(self.ob())[".hide_vert"], ~shown)
        ends = np.empty(2 * len(self.ob().data.edges), np.int32)
        self.ob().data.edges.foreach_get("vertices", ends)
        sides = np.sort(corners[~hidden][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges = set(map(tuple, sides.tolist()))
        seen = [tuple(sorted(pair)) in edges for pair in ends.reshape(-1, 2).tolist()]
        np.testing.assert_array_equal(painted(self.ob())[".hide_edge"], ~np.array(seen))

    def test_hidden_vertices_stay(self) -> None:
        self.ob().data.vertices.foreach_set("hide", half(self.ob()) > 0)
        self.sculpt()
        x = vertices(self.ob())[:, 0]
        self.assertLess(np.abs(self.raised()[x > EDGE]).max(), 2e-4)
        self.assertTrue(painted(self.ob())[".hide_vert"][x > EDGE].all())

    def test_face_sets_are_carried(self) -> None:
        mesh = self.ob().data
        mesh.attributes.new(".sculpt_face_set", "INT", "FACE")
        sets = np.where(middles(self.ob())[:, 1] > 0, 3, 7).astype(np.int32)
        mesh.attributes[".sculpt_face_set"].data.foreach_set("value", sets)
        self.sculpt()
        sets, y = painted(self.ob())[".sculpt_face_set"], middles(self.ob())[:, 1]
        self.assertTrue((sets[y > EDGE] == 3).all())
        self.assertTrue((sets[y < -EDGE] == 7).all())

    def test_a_stroke_on_masked_ground_alone_is_refused(self) -> None:
        paint(self.ob(), half(self.ob()))
        self.line = arc(self.ob(), 0.3) @ np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])  # to +X
        self.assert_fails("masked or hidden", stroke, points=self.line, radius=0.1, intensity=0.05)
        self.assertEqual(len(self.ob().neural_sculpt.strokes), 0)
        self.line[:, 0] *= -1
        stroke(self.line, radius=0.1, intensity=0.05)
        self.assertNotIn("mask", strokes_of(self.ob())[0])  # nothing is masked there

    def test_of_many_strokes_those_on_masked_ground_are_left_out(self) -> None:
        """And the artist hears which; a file of nothing else is refused."""
        to_right = arc(self.ob(), 0.3) @ np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])
        to_right *= np.sign(to_right[4, 0]), 1, 1
        given = {"radius": 0.1, "intensity": 0.05}
        masked, free = ({**given, "points": (to_right * (side, 1, 1)).tolist()} for side in (1, -1))
        paint(self.ob(), half(self.ob()))
        with patch.object(
            module("blender.operators.job_operator"), "translated", side_effect=lambda told: told
        ) as translated:
            self.file([masked, free, masked, {**free, "name": "Last"}])
        ((sentence,), _) = translated.call_args
        self.assertIn("strokes 1, 3 would change", sentence)
        self.assertEqual([s.name for s in self.ob().neural_sculpt.strokes][-1], "Last")
        self.assertEqual(len(self.ob().neural_sculpt.strokes), 2)
        x = vertices(self.ob())[:, 0]
        self.assertLess(np.abs(self.raised()[x > 0]).max(), 3e-4)
        self.assertGreater(self.raised()[x < 0].max(), 0.04)
        before = state(self.ob())
        self.assert_fails("All that the strokes would change", self.file, strokes=[masked, masked])
        self.assertEqual(state(self.ob()), before)

    def file(self, strokes: list[dict[str, object]]) -> set[str]:
        """Have the strokes of a file sculpted."""
        path = self.folder / "strokes.json"
        path.write_text(json.dumps({"version": 1, "strokes": strokes}))
        return bpy.ops.neural_sculpt.strokes_from_file(filepath=str(path))

    def test_a_mirror_image_has_the_mask_where_it_is(self) -> None:
        self.ob().data.use_mirror_y = True
        self.line = arc(self.ob(), tilt=0.5)
        paint(self.ob(), vertices(self.ob())[:, 1] * self.line[4, 1] < 0)
        self.sculpt()
        y = vertices(self.ob())[:, 1] * np.sign(self.line[4, 1])
        self.assertGreater(self.raised()[y > 0].max(), 0.059)
        self.assertLess(np.abs(self.raised()[y < -EDGE]).max(), 2e-4)

    @long
    def test_remesh_and_other_jobs_keep_the_mask(self) -> None:
        paint(self.ob(), half(self.ob()))
        self.sculpt()
        for change in (
            lambda: bpy.ops.neural_sculpt.remesh(resolution=64),
            bpy.ops.neural_sculpt.mute_stroke,
            bpy.ops.neural_sculpt.mute_stroke,
            lambda: bpy.ops.neural_sculpt.consolidate(width=32),
        ):
            change()
            mask, x = painted(self.ob())[".sculpt_mask"], vertices(self.ob())[:, 0]
            self.assertTrue((mask[x > EDGE] == 1).all())
            self.assertTrue((mask[x < -EDGE] == 0).all())

    def test_a_result_waits_until_what_it_takes_over_is_found(self) -> None:
        """In a window: in steps, of which there are some; what is painted meanwhile counts."""
        next_proxy = module("blender.scene.next_proxy")
        self.ob().data.polygons.foreach_set("hide", middles(self.ob())[:, 1] > 0)
        paint(self.ob(), half(self.ob()))
        prepare, answers = next_proxy.prepare, []

        def watched(ob: Object, result: object, smooth: bool) -> bool:
            answers.append(prepare(ob, result, smooth))
            if len(answers) == 1:
                paint(ob, 1 - half(ob))
            return answers[-1]

        with (
            self.as_in_a_window(),
            patch.object(next_proxy, "prepare", watched),
        ):
            bpy.ops.neural_sculpt.remesh(resolution=64)
            self.finish()
        self.assertGreater(len(answers), 2)
        self.assertEqual(answers, [True] * (len(answers) - 1) + [False])
        mask, x = painted(self.ob())[".sculpt_mask"], vertices(self.ob())[:, 0]
        self.assertTrue((mask[x > EDGE] == 0).all())
        self.assertTrue((mask[x < -EDGE] == 1).all())
        hidden, y = painted(self.ob())[".hide_poly"], middles(self.ob())[:, 1]
        self.assertTrue(hidden[y > EDGE].all())
        self.assertFalse(hidden[y < -EDGE].any())

    def test_other_kinds_of_strokes_stay_away_too(self) -> None:
        self.sculpt()
        before = self.raised(), vertices(self.ob())
        brush_settings().kind = "SMOOTH"
        brush_settings().strength = 1.0
        paint(self.ob(), half(self.ob()))
        stroke(self.line, radius=0.2)
        after, x = self.raised(), vertices(self.ob())[:, 0]
        self.assertLess(after[x < -NEW_EDGES].max(), before[0].max() - 0.005)
        found = nearest(vertices(self.ob())[x > EDGE], before[1])
        away = np.linalg.norm(vertices(self.ob())[x > EDGE] - before[1][found], axis=1)
        self.assertLess(np.median(away), 1e-5)
        self.assertAlmostEqual(after[x > EDGE].max(), before[0].max(), delta=2e-3)


class Preview(unittest.TestCase):
    def test_a_preview_shows_what_a_mask_leaves(self) -> None:
        points, triangles = square()
        line = np.array([[-0.4, 0, 0], [0.4, 0, 0]])
        brush = module("stroke.brush").Brush(0.2, 0.05, module("stroke.profile").Profile("linear"))
        y = points[:, 1]
        masked = np.clip(0.5 - y / 0.1, 0, 1)
        mask = Mask.of(points, masked, 0.02)
        result = module("interaction.displaced").Displaced(points, triangles)
        result.add(Stroke(line, brush, mask=mask))
        z = np.zeros(len(points))
        z[result.vertices] = result.positions[:, 2]
        height = 0.05 * np.maximum(1 - to_path(points, line) / 0.2, 0)
        under_the_pen = module("interaction.displaced").Displaced(points, triangles)
        under_the_pen.begin(Stroke(line, brush), masked.astype(np.float32))
        under_the_pen.advance()
        drawn = np.zeros(len(points))
        drawn[under_the_pen.vertices] = under_the_pen.positions[:, 2]
        np.testing.assert_allclose(drawn, height * (1 - masked), atol=1e-6)
        np.testing.assert_allclose(z, height * (1 - masked), atol=0.01)
        np.testing.assert_allclose(z[y > 0.09], height[y > 0.09], atol=1e-6)
        np.testing.assert_allclose(z[masked == 1], 0, atol=1e-9)


class Nearest(unittest.TestCase):
    def test_it_is_the_nearest_of_neighbours_and_near_of_others(self) -> None:
        random = np.random.default_rng(5)
        among = random.normal(size=(4000, 3))
        among = (0.6 * among / np.linalg.norm(among, axis=1, keepdims=True)).astype(np.float32)
        same, close = among[500:3500], among[::3] + np.float32(0.005)
        points = np.concatenate([same, close, 1.5 * among[:50]])
        distance = np.linalg.norm(points[:, None] - among, axis=2)
        found = nearest(points, among)
        away = np.linalg.norm(points - among[found], axis=1)
        np.testing.assert_array_equal(found[: len(same)], np.arange(500, 3500))
        np.testing.assert_allclose(away[:-50], distance.min(axis=1)[:-50], atol=1e-6)
        np.testing.assert_allclose(away[-50:], distance.min(axis=1)[-50:], atol=0.01)

    def test_a_point_that_is_no_number_is_near_to_none(self) -> None:
        among = np.float32([[np.nan] * 3, [0, 0, 0], [np.inf, 0, 0], [1, 0, 0]])
        points = np.float32([[0.1, 0, 0], [0.8, 0.1, 0]])
        np.testing.assert_array_equal(nearest(points, among), [1, 3])
        self.assertEqual(len(nearest(points, among[:1])), 2)

    def test_few_points_and_none(self) -> None:
        one, two = np.float32([[0.1, 0.2, 0.3]]), np.float32([[0, 0, 0], [1, 0, 0]])
        np.testing.assert_array_equal(nearest(two, one), [0, 0])
        np.testing.assert_array_equal(nearest(one, two), [0])
        np.testing.assert_array_equal(nearest(two, two), [0, 1])
        self.assertEqual(len(nearest(two[:0], one)), 0)
