# SPDX-License-Identifier: GPL-3.0-or-later
"""OFF files as other programs write them: polygons of any kind, colors, normals and comments."""

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.mesh import mesh_file

# A house: a cube of edge 2 whose front and back are pentagons up to a ridge 1 higher.
CORNERS = [(x, y, z) for x in (0, 2) for y, z in ((0, 0), (2, 0), (2, 2), (1, 3), (0, 2))]
FACES = [
    *((4, 3, 2, 1, 0), (5, 6, 7, 8, 9)),
    *((0, 1, 6, 5), (1, 2, 7, 6), (2, 3, 8, 7), (4, 0, 5, 9), (3, 4, 9), (3, 9, 8)),
]
VOLUME, AREA = 10, 2 * 5 + 3 * 4 + 2 * 2 * np.sqrt(2)
TRIANGLES = 2 * 3 + 4 * 2 + 2

COUNTS = f"{len(CORNERS)} {len(FACES)} 0"


def text(first: str = f"OFF\n{COUNTS}", vertex: str = "", face: str = "", end: str = "\n") -> str:
    """The house as a file whose vertices and faces have more behind what they need."""
    lines = [first, *("{} {} {}".format(*corner) + vertex for corner in CORNERS)]
    lines += [f"{len(each)} {' '.join(map(str, each))}{face}" for each in FACES]
    return end.join(lines).replace("\n", end) + end


FILES = {
    "plain": text(),
    "counts beside the word": text(f"OFF {COUNTS}"),
    "counts at the word": text(f"OFF{COUNTS}"),
    "no word": text(COUNTS),
    "small word": text(f"off\n{COUNTS}"),
    "two counts": text(f"OFF\n{len(CORNERS)} {len(FACES)}"),
    "colors of vertices": text(f"COFF\n{COUNTS}", " 255 0 0 255"),
    "normals": text(f"NOFF\n{COUNTS}", " 0 0 1"),
    "all of them": text(f"STCNOFF\n{COUNTS}", " 0 0 1 0.1 0.2 0.3 1 0.5 0.5"),
    "all of them, of MeshLab": text(f"NCSTOFF\n{COUNTS}", " 0 0 1 255 0 0 255 0.5 0.5"),
    "colors of faces": text(face=" 0.1 0.2 0.3"),
    "comments": text(f"# OFF of a\n\nOFF # test\n#\n{COUNTS} # counts\n", " # v", " # f\n\n# next"),
    "of Windows": "\ufeff" + text(end="\r\n"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_house_of_pentagons_quads_and_triangles(tmp_path, name):
    path = tmp_path / "house.off"
    path.write_bytes(FILES[name].encode())
    vertices, triangles = mesh_file.read(path)
    np.testing.assert_array_equal(vertices, CORNERS)
    assert triangles.shape == (TRIANGLES, 3)
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    assert np.einsum("ij,ij->", np.cross(a, b), c) / 6 == pytest.approx(VOLUME)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(AREA)


def test_faces_of_two_corners_are_no_surface(tmp_path):
    (tmp_path / "line.off").write_text("OFF\n3 3 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n0\n")
    assert mesh_file.read(tmp_path / "line.off")[1].tolist() == [[0, 1, 2]]
    (tmp_path / "lines.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n")
    with pytest.raises(SculptError, match="holds no triangles"):
        mesh_file.read(tmp_path / "lines.off")


@pytest.mark.parametrize("first", range(6))
def test_a_prism_over_an_l(tmp_path, first):
    """Two faces of six corners, one of them a notch: an area of 3 each, and walls of 8."""
    base = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    corners = "".join(f"{x} {y} {z}\n" for z in (0, 1) for x, y in base)
    ring = [(first + i) % 6 for i in range(6)]
    walls = "".join(f"4 {i} {(i + 1) % 6} {(i + 1) % 6 + 6} {i + 6}\n" for i in range(6))
    floor, roof = " ".join(map(str, ring[::-1])), " ".join(str(i + 6) for i in ring)
    text = f"OFF\n12 8 0\n{corners}6 {floor}\n6 {roof}\n{walls}"
    (tmp_path / "prism.off").write_text(text)
    vertices, triangles = mesh_file.read(tmp_path / "prism.off")
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    assert np.einsum("ij,ij->", np.cross(a, b), c) / 6 == pytest.approx(3)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(14)


CORNER = "0 0 0\n1 0 0\n0 1 0\n"


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("", "does not begin as an OFF file"),
        ("OFF\n", "does not begin as an OFF file"),
        ("OFF BINARY\n3 1 0\n", "does not begin as an OFF file"),
        (f"4OFF\n3 1 0\n{CORNER}3 0 1 2\n", "does not begin as an OFF file"),
        (f"OFF\n-3 1 0\n{CORNER}3 0 1 2\n", "does not begin as an OFF file"),
        (f"OFF\n3 99999999999999999999 0\n{CORNER}3 0 1 2\n", "fewer vertices and faces"),
        ("OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "fewer than three coordinates"),
        (f"OFF\n3 1 0\n{CORNER}4 0 1 2\n", "fewer corners"),
        (f"OFF\n3 1 0\n{CORNER}-1 0 1 2\n", "fewer corners"),
        (f"OFF\n3 1 0\n{CORNER}3 0 1 3\n", "a corner that is not there"),
        (f"OFF\n3 1 0\n{CORNER}3 0 1 -1\n", "a corner that is not there"),
        (f"OFF\n3 1 0\n{CORNER}3 0 1 99999999999999999999\n", "too large"),
        ("OFF\n3 1 0\n0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n", "could not convert"),
    ],
)
def test_damaged_files_are_refused_in_a_sentence(tmp_path, content, why):
    (tmp_path / "bad.off").write_text(content)
    with pytest.raises(SculptError, match=why) as caught:
        mesh_file.read(tmp_path / "bad.off")
    assert "\n" not in str(caught.value)
