# SPDX-License-Identifier: GPL-3.0-or-later
"""OBJ files whose faces are concave, written in different ways, or damaged."""

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.mesh import mesh_file

# A prism over an L: floor and roof of area 3 with a notch, walls of 8 around.
BASE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
CORNERS = [(x, y, z) for z in (0, 1) for x, y in BASE]
WALLS = [(i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6) for i in range(6)]


def measures(path) -> tuple[float, float]:
    """Volume and area."""
    vertices, triangles = mesh_file.read(path)
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return np.einsum("ij,ij->", np.cross(a, b), c) / 6, area


@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("walls", ["{0}", "{0}/1", "{0}//1", "{0}/1/1"])
def test_a_prism_over_an_l(tmp_path, first, walls):
    """Its floor and roof are faces of six numbers, as walls of three with normals would be."""
    ring = [(first + i) % 6 for i in range(6)]
    lines = ["# ZBrush", "mtllib a.mtl", "o prism", "vt 0 0", "vn 0 0 1"]
    lines += ["v {} {} {} 0.5 0.5 0.5".format(*corner) for corner in CORNERS]
    lines += ["#MRGB ffffffff01020304", "g ends", "usemtl one", "s off"]
    lines += [
        "f " + " ".join(str(i + 1) for i in face) for face in (ring[::-1], [i + 6 for i in ring])
    ]
    lines += ["usemtl two"]
    for wall in WALLS:
        lines += [
            f"f {' '.join(walls.format(i + 1) for i in (wall[0], *ends))}"
            for ends in (wall[1:3], wall[2:])
        ]
    (tmp_path / "prism.obj").write_text("\n".join(lines))
    assert measures(tmp_path / "prism.obj") == (pytest.approx(3), pytest.approx(14))


def test_lines_of_old_macs_and_vertices_with_and_without_colors(tmp_path):
    lines = ["# a", "v 0 0 0 1 0 0", "v 1 0 0", "v 0 1 0 1", "v 0 0 1 1 1 1"]
    lines += ["f 1 3 \\ ", "2 4"]
    (tmp_path / "mac.obj").write_bytes("\r".join(lines).encode())
    vertices, triangles = mesh_file.read(tmp_path / "mac.obj")
    np.testing.assert_array_equal(vertices, [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    assert len(triangles) == 2


@pytest.mark.parametrize(
    ("face", "why"),
    [
        ("f 0 1 2", "a corner that is not there"),
        ("f 1 2 4", "a corner that is not there"),
        ("f 1 2 -4", "counts back beyond"),
        ("f 1 2 x", "invalid literal"),
        ("f 1 2 1.5", "invalid literal"),
        ("f 1 2", "holds no triangles"),
        ("v 1 2\nf 1 2 3", "fewer than three coordinates"),
    ],
)
def test_damaged_files_are_refused_in_a_sentence(tmp_path, face, why):
    (tmp_path / "bad.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\n{face}\n")
    with pytest.raises(SculptError, match=why) as caught:
        mesh_file.read(tmp_path / "bad.obj")
    assert "\n" not in str(caught.value)
