# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the curve widgets: what is chosen is shown, and a stroke gets what is shown."""

import json
import os
import shutil
import signal
import unittest
from dataclasses import replace

import bpy
import numpy as np
from harness import SculptCase, brush_settings, module

ops = bpy.ops.neural_sculpt
KINDS = ("profile", "modulation")


class Presets(SculptCase):
    def setUp(self) -> None:
        super().setUp()
        self.presets, self.store = (
            module("blender.presets.presets"),
            module("blender.presets.curve_store"),
        )
        self.files = module("interaction.preset_file")
        self.brush = brush_settings()
        self.addCleanup(self.presets.refresh)
        self.addCleanup(shutil.rmtree, module("blender.folders").preset_folder(), True)

    def shown(self, kind: str) -> np.ndarray:
        """The widget's own curve, at 257 points of its domain."""
        widget = self.store.mapping(kind)
        return np.array([widget.evaluate(widget.curves[0], x) for x in self.domain(kind)])

    def built_in(self, kind: str) -> dict[str, object]:
        """The presets that come with the extension, by their choice."""
        return {p.name.upper(): p for p in self.files.BUILT_IN if p.kind == kind}

    def domain(self, kind: str) -> np.ndarray:
        return np.linspace(*self.files.BOUNDS[kind], 257)

    def gets(self, kind: str) -> np.ndarray:
        """What a stroke gets at the same points, the right of the widget at its right."""
        to_left = -1 if kind == "profile" else 1
        return getattr(
            module("blender.scene.brush.current_brush").current_brush(bpy.context), kind
        )(to_left * self.domain(kind))

    def test_the_paper_and_more_can_be_chosen(self) -> None:
        wanted = {
            "profile": "LINEAR CUBIC QUINTIC RIDGE CREASE SEAM SCALES BRAID DENT CHISEL GEM",
            "modulation": "IDENTITY LINEAR EXPONENTIAL CENTRAL INVERSE_CENTRAL SINUSOIDAL TAPER"
            " SCALES BRAID",
        }
        for kind, names in wanted.items():
            for name in names.split():
                setattr(self.brush, kind, name)
                formula = name.lower() in module(f"stroke.{kind}").__dict__[kind.title()].FORMULAS
                self.assertEqual(getattr(self.brush, kind), name if formula else "CURVE")

    def test_a_preset_is_shown_and_what_is_shown_is_what_a_stroke_gets(self) -> None:
        for kind in KINDS:
            for name, preset in self.built_in(kind).items():
                setattr(self.brush, kind, name)
                shown, gets = self.shown(kind), self.gets(kind)
                np.testing.assert_allclose(gets, shown, atol=2e-3, err_msg=name)
                x, y = np.array(preset.points).T
                at = np.interp(x, self.domain(kind), gets)
                np.testing.assert_allclose(at, y, atol=0.06, err_msg=name)
                if kind == "profile":
                    self.assertLess(abs(gets[0]) + abs(gets[-1]), 1e-5, name)
                self.assertAlmostEqual(np.abs(gets).max(), 1.0, delta=0.01, msg=name)

    def test_thumbnails_show_about_the_same(self) -> None:
        thumbnails = module("blender.presets.thumbnails")
        for kind in KINDS:
            for name, preset in self.built_in(kind).items():
                setattr(self.brush, kind, name)
                drawn = thumbnails.sample(preset)
                at = np.interp(self.domain(kind), np.linspace(*self.files.BOUNDS[kind], 256), drawn)
                self.assertLess(np.abs(at - self.gets(kind)).mean(), 0.1, name)
                picture = thumbnails.draw(kind, drawn)
                self.assertEqual(picture.shape, (64, 64, 4))
                self.assertTrue((picture[..., 3].max(0) > 0.9).all(), "a line from side to side")

    def test_save_choose_rename_delete(self) -> None:
        self.brush.profile = "GEM"
        widget = self.store.mapping("profile")
        widget.curves[0].points[1].location.y = 0.5
        widget.update()
        mine = self.gets("profile")
        ops.save_preset(kind="profile", name="Für Élise")
        (stem,) = self.presets.own("profile")
        self.assertEqual(self.presets.own("modulation"), {})
        self.brush.profile = "DENT"
        self.brush.profile = f"OWN:{stem}"
        np.testing.assert_allclose(self.gets("profile"), mine, atol=1e-5)
        ops.rename_preset(kind="profile", preset=stem, name="Ruby")
        ((stem, preset),) = self.presets.own("profile").items()
        self.assertEqual(preset.name, "Ruby")
        ops.save_preset(kind="profile", name="Ruby")
        self.assertEqual(len(self.presets.own("profile")), 1, "the same name replaces it")
        ops.delete_preset(kind="profile", preset=stem)
        self.assertEqual(self.presets.own("profile"), {})

    def test_without_presets_of_ones_own_there_are_none_to_rename_or_delete(self) -> None:
        for operator in (ops.rename_preset, ops.delete_preset, ops.open_presets):
            self.assertFalse(operator.poll())
        self.brush.modulation = "BEADS"
        ops.save_preset(kind="modulation", name="Pearls")
        for operator in (ops.rename_preset, ops.delete_preset, ops.open_presets):
            self.assertTrue(operator.poll())

    def test_share(self) -> None:
        self.brush.modulation = "BEADS"
        ops.save_preset(kind="modulation", name="Pearls")
        (path,) = module("blender.folders").preset_folder().iterdir()
        shared = self.folder / "from a friend.json"
        path.rename(shared)
        self.presets.refresh()
        self.assertEqual(self.presets.own("modulation"), {})
        ops.import_preset(filepath=str(shared))
        (preset,) = self.presets.own("modulation").values()
        self.assertEqual(preset, self.store.preset("modulation", "Pearls"))

    def test_none_takes_the_place_of_another_one(self) -> None:
        """Whose name differs in letters alone that no file's name has; or of one by the same name,
        which is not the one that was saved."""
        self.brush.profile = "GEM"
        ops.save_preset(kind="profile", name="Ä")
        self.brush.profile = "DENT"
        ops.save_preset(kind="profile", name="Ö")
        self.brush.profile = "RIDGE"
        ops.save_preset(kind="profile", name="Other")
        before = self.presets.own("profile")
        stems = {preset.name: stem for stem, preset in before.items()}
        self.assertEqual({*stems}, {"Ä", "Ö", "Other"})
        other = {"kind": "profile", "preset": stems["Other"]}
        self.assert_fails("already a preset Ö.", ops.rename_preset, **other, name="Ö")
        shared = self.folder / "from a friend.json"
        shared.write_text(self.files.dump_preset(replace(before[stems["Other"]], name="Ä")))
        self.assert_fails("already a preset Ä.", ops.import_preset, filepath=str(shared))
        self.assertEqual(self.presets.own("profile"), before)
        ops.rename_preset(**other, name="Ü")
        self.assertEqual({p.name for p in self.presets.own("profile").values()}, {"Ä", "Ö", "Ü"})

    def test_rename_takes_the_old_name_away_and_no_other(self) -> None:
        """Wherever among the others the new one stands: Blender knows a choice by its place."""
        self.brush.profile = "GEM"
        for name in ("A", "C", "D"):
            ops.save_preset(kind="profile", name=name)
        stems = {preset.name: stem for stem, preset in self.presets.own("profile").items()}
        ops.rename_preset(kind="profile", preset=stems["D"], name="B")
        self.assertEqual({p.name for p in self.presets.own("profile").values()}, {"A", "B", "C"})

    @unittest.skipUnless(os.name == "posix", "no file can be limited")
    def test_a_preset_for_which_there_is_no_room_leaves_the_one_that_is_there(self) -> None:
        import resource

        self.brush.profile = "GEM"
        ops.save_preset(kind="profile", name="Mine")
        (path,) = module("blender.folders").preset_folder().iterdir()
        written = path.read_bytes()
        self.brush.profile = "DENT"
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # as Python itself has it
        _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (10, most))
        try:
            self.assert_fails("Free some space", ops.save_preset, kind="profile", name="Mine")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
        self.assertEqual([*path.parent.iterdir()], [path])
        self.assertEqual(path.read_bytes(), written)

    def test_only_a_curve_can_be_saved(self) -> None:
        self.assert_fails("Choose Curve", ops.save_preset, kind="profile", name="Mine")
        self.brush.profile = "CURVE"
        self.assert_fails("name", ops.save_preset, kind="profile", name=" ")

    def test_bad_files_are_refused_and_skipped(self) -> None:
        good = json.loads(self.files.dump_preset(self.built_in("profile")["GEM"]))
        bad = [
            "",
            "[]",
            "[" * 100_000,
            json.dumps(good | {"version": 2}),
            json.dumps(good | {"kind": "brush"}),
            json.dumps(good | {"name": ""}),
            json.dumps(good | {"name": "a\nb"}),
            json.dumps(good | {"name": "n" * 49}),
            json.dumps(good | {"more": 1}),
            json.dumps(good | {"points": [[-1, 0]]}),
            json.dumps(good | {"points": [[-1, 0], [1, True], [2, 3]]}),
            json.dumps(good | {"points": [[-1, 0], [-1, 0], [0, 0], [1, 0]]}),
            json.dumps(good | {"points": [[-1, 0], [0, 5], [0.5, 0], [1, 0]]}),
            json.dumps(good | {"points": [[-1, 0], [0, float("nan")], [0.5, 0], [1, 0]]}),
            json.dumps(good | {"points": {"a": 1}}),
            json.dumps(good | {"handles": ["AUTO"] * 3}),
            json.dumps(good | {"handles": ["ALIGNED"] * 4}),
            json.dumps(good | {"handles": 4}),
            " " * 70_000,
        ]
        folder = module("blender.folders").preset_folder()
        folder.mkdir(parents=True, exist_ok=True)
        for number, text in enumerate(bad):
            path = folder / f"bad {number}.json"
            path.write_text(text)
            self.assert_fails("", ops.import_preset, filepath=str(path))
        (folder / "bytes.json").write_bytes(b"\xff\xfe")
        self.assert_fails("cannot be read", ops.import_preset, filepath=str(folder / "bytes.json"))
        (folder / "QUINTIC.json").write_text(json.dumps(good))
        self.presets.refresh()
        self.assertEqual(list(self.presets.own("profile")), ["QUINTIC"])
        self.brush.profile = "QUINTIC"
        self.assertEqual(self.brush.profile, "QUINTIC", "no file takes the place of a formula")
