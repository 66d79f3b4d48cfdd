# SPDX-License-Identifier: GPL-3.0-or-later
"""STL files as other programs write them, and cut short."""

import struct

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.mesh import mesh_file

BOX = trimesh.creation.box((1, 2, 3))
CORNERS = BOX.vertices[BOX.faces]  # (12, 3, 3)


def solid(name: str = "box", move: int = 0) -> str:
    """A box as text, moved along X."""
    facets = "".join(
        "facet normal 0 0 0\n outer loop\n"
        + "".join(f"  vertex {x + move} {y:e} {z}\n" for x, y, z in corners.tolist())
        + " endloop\nendfacet\n"
        for corners in CORNERS
    )
    return f"solid {name}\n{facets}endsolid {name}\n"


def rows(header: bytes = b"", count: int = len(CORNERS)) -> bytes:
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *corners.ravel(), 7) for corners in CORNERS)
    return header.ljust(80, b"\0") + struct.pack("<I", count) + body


FILES = {
    "text": solid().encode(),
    "no name": solid("").encode(),
    "capitals": solid().upper().encode(),
    "Windows": b"\xef\xbb\xbf" + solid().replace("\n", "\r\n").encode(),
    "old Mac": solid().replace("\n", "\r").encode(),
    "one line": " ".join(solid().split()).encode(),
    "name of a word": solid("vertex group facet endsolid").encode(),
    "name in Latin-1": solid("K\u00f6rper").encode("latin-1"),
    "no name at its end": solid().rpartition("box")[0].encode(),
    "bytes": rows(),
    "bytes of a solid": rows(b"solid box"),
    "bytes of a solid and blanks": rows(b"solid box".ljust(80)),
    "bytes and one more": rows() + b"\n",
}


@pytest.mark.parametrize("name", FILES)
def test_a_box_comes_in_whole(tmp_path, name):
    (tmp_path / "box.stl").write_bytes(FILES[name])
    vertices, triangles = mesh_file.read(tmp_path / "box.stl")
    assert vertices.dtype == np.float32
    np.testing.assert_array_equal(vertices[triangles], CORNERS)


def test_all_solids_of_a_file_come_in(tmp_path):
    names = ["one", "vertex_group", "one", ""]
    text = "".join(solid(name, 2 * i) for i, name in enumerate(names))
    (tmp_path / "boxes.stl").write_text(text)
    vertices, triangles = mesh_file.read(tmp_path / "boxes.stl")
    expected = [CORNERS + np.array([2 * i, 0, 0]) for i in range(len(names))]
    np.testing.assert_array_equal(vertices[triangles], np.concatenate(expected))


def test_a_file_that_is_cut_anywhere_is_refused(tmp_path):
    """But for the last name, which tells nothing."""
    whole = (solid("a") + solid("b", 2)).encode()
    path = tmp_path / "cut.stl"
    for size in [*range(400), *range(len(solid("a")) + 1, len(whole) - len("d b\n"))]:
        path.write_bytes(whole[:size])
        with pytest.raises(SculptError, match=r"cut\.stl"):
            mesh_file.read(path)


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (rows()[:-1], "fewer triangles"),
        (rows(count=13), "fewer triangles"),
        (rows(count=11), "more triangles"),
        (solid().replace("vertex 0.5", "vertex x", 1).encode(), "no numbers"),
        (solid().replace("0.5", "0,5").encode(), "no numbers"),
        (solid().replace(" endloop", "vertex 0 0 0\nendloop", 1).encode(), "no triangle"),
        (solid().replace("endfacet", "", 1).encode(), "no triangle"),
        (b"solid empty\nendsolid empty\n", "no triangles"),
    ],
)
def test_damaged_files_are_refused_in_words(tmp_path, data, why):
    (tmp_path / "bad.stl").write_bytes(data)
    with pytest.raises(SculptError, match=why):
        mesh_file.read(tmp_path / "bad.stl")
