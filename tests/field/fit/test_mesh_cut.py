# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces cut along each other, few at once and many in a process of their own."""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.common.progress import silent
from neural_sculpt_addon.field.fit import mesh_union
from neural_sculpt_addon.field.fit.mesh_cut import FEW, cut_along
from neural_sculpt_addon.field.fit.mesh_union import crossings, cut
from neural_sculpt_addon.field.fit.mesh_winding import Winding
from neural_sculpt_addon.field.geometry import areas


def plates(count):
    """Thin plates through each other, each turned another way."""
    rng = np.random.default_rng(5)
    made = []
    for _ in range(count):
        turn = trimesh.transformations.random_rotation_matrix(rng.random(3))
        made.append(trimesh.creation.box((1.5, 1.5, 0.05)).apply_transform(turn))
    return trimesh.util.concatenate(made)


@pytest.mark.parametrize("pairs", [1, FEW + 1])
def test_two_squares_through_each_other_are_cut_at_their_common_line(pairs):
    """Each in halves, whatever these are made of: the line lies in the plane of the other."""
    flat = [[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]]
    upright = np.array(flat, float)[..., [2, 0, 1]] + [0.25, 0, 0]  # x = 0.25
    corners = np.concatenate([np.array(flat, float), upright])
    triangles, owners = cut_along(corners, pairs, silent)
    assert np.bincount(owners, areas(triangles)) == pytest.approx([2, 2, 2, 2])
    across = [(triangles[owners < 2][..., 0] - 0.25), triangles[owners >= 2][..., 2]]
    for side in across:
        assert not ((side.min(axis=1) < -1e-9) & (side.max(axis=1) > 1e-9)).any()


def test_a_process_cuts_alike_and_is_watched():
    whole = plates(8)
    corners = whole.vertices[whole.faces]
    looks = []
    here = cut_along(corners, 0, silent)
    there = cut_along(corners, FEW + 1, lambda fraction, text: looks.append(text))
    assert len(looks) > 2
    assert np.bincount(there[1], areas(there[0])) == pytest.approx(areas(corners))
    assert np.bincount(here[1]).tolist() == np.bincount(there[1]).tolist()


def test_cutting_can_be_cancelled():
    whole = plates(40)  # minutes
    looks = iter(range(4))

    def cancelled(fraction, text):
        if next(looks) == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        cut_along(whole.vertices[whole.faces], FEW + 1, cancelled)


def test_what_cannot_be_cut_is_told():
    with pytest.raises(SculptError, match="Unite the parts"):
        cut_along(np.full((2, 3, 3), np.nan), FEW + 1, silent)


def test_no_place_for_files_is_told(monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "absent"))
    with pytest.raises(SculptError, match=r"\(No such file or directory\)"):
        cut_along(np.zeros((2, 3, 3)), FEW + 1, silent)


def test_what_is_too_much_to_cut_is_divided_where_it_is_hidden(monkeypatch):
    """Needles in a slab: cut, none of them is left in it; else it keeps its faces, and how many
    crossings are left is told."""
    needles = [
        trimesh.creation.box((0.04, 0.04, 0.4)).apply_translation((x, y, 0))
        for x in np.linspace(-0.7, 0.7, 10)
        for y in np.linspace(-0.7, 0.7, 10)
    ]
    whole = trimesh.util.concatenate([trimesh.creation.box((1.7, 1.7, 0.1)), *needles])
    pairs = crossings(whole.vertices, whole.faces)
    assert len({needle for needle, _ in np.sort(pairs // 12)[:, ::-1]}) == len(needles)
    outside = whole.area - len(needles) * (2 * 0.04**2 + 4 * 0.04 * 0.1)
    winding = Winding(whole.vertices, whole.faces)

    def cut_up_to(most):
        monkeypatch.setattr(mesh_union, "MOST_PAIRS", most)
        parts = cut(whole.vertices, whole.faces, pairs, winding, silent)
        on_slab = np.abs(np.abs(parts.surface[..., 2]) - 0.05).max(axis=1) < 1e-6
        return parts, areas(parts.surface[on_slab]).sum()

    parts, slab = cut_up_to(len(pairs))
    assert areas(parts.surface).sum() == pytest.approx(outside, rel=1e-6)
    assert parts.uncut == 0
    parts, partly = cut_up_to(len(pairs) // 2)
    assert partly == pytest.approx(slab, rel=0.03)
    assert len(pairs) / 2 <= parts.uncut < len(pairs)
