# SPDX-License-Identifier: GPL-3.0-or-later
"""PLY files, binary ones written here byte by byte: faces of any number of corners."""

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.mesh import mesh_file

CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7), (1, 7, 3)]
LISTS = "property list uchar uint vertex_indices\n"


def ply(
    faces: list[tuple[int, ...]], order: str = "<", lists: str = LISTS, row: str = "B{}I"
) -> bytes:
    """A file of the cube's vertices; `row`: how `struct` writes a face's length and corners."""
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    header = f"ply\nformat {kind} 1.0\ncomment of a test\nelement vertex {len(CUBE)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "property uchar red\n"
    header += f"element face {len(faces)}\n{lists}end_header\n"
    body = b"".join(struct.pack(f"{order}3fB", *point, 7) for point in CUBE.tolist())
    for face in faces:
        body += struct.pack(order + row.format(len(face)), len(face), *face)
    return header.encode() + body


def read(path: Path, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    path.write_bytes(data)
    return mesh_file.read(path)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(
    ("lists", "row"),
    [
        (LISTS, "B{}I"),
        ("property list int int vertex_index\n", "i{}i"),
        ("property list uint8 uint16 vertex_indices\n", "B{}H"),
    ],
)
def test_quads_and_triangles_are_one_cube(tmp_path, order, lists, row):
    vertices, triangles = read(tmp_path / "cube.ply", ply(FACES, order, lists, row))
    np.testing.assert_array_equal(vertices, CUBE)
    assert vertices.dtype == np.float32
    cube = trimesh.Trimesh(vertices, triangles, process=False)
    assert (cube.is_watertight, cube.volume) == (True, pytest.approx(1))


@pytest.mark.parametrize("kind", ["float", "int"])
def test_faces_may_stand_before_the_vertices_and_integers_are_exact(tmp_path, kind):
    large = 1 << 24 if kind == "int" else 0  # float32 would make one of two odd numbers beyond it
    header = f"ply\nformat binary_little_endian 1.0\nelement face {len(FACES)}\n{LISTS}"
    header += f"element vertex {len(CUBE)}\n"
    header += "".join(f"property {kind} {axis}\n" for axis in "xyz") + "end_header\n"
    body = b"".join(struct.pack(f"<B{len(face)}I", len(face), *face) for face in FACES)
    for x, y, z in CUBE.astype(int).tolist():
        body += struct.pack("<3i" if kind == "int" else "<3f", x + large, y, z)
    vertices, triangles = read(tmp_path / "cube.ply", header.encode() + body)
    np.testing.assert_array_equal(vertices - [large, 0, 0], CUBE)
    assert vertices.dtype == (np.float64 if kind == "int" else np.float32)
    assert trimesh.Trimesh(CUBE, triangles, process=False).volume == pytest.approx(1)


def test_other_properties_of_faces_are_passed_over(tmp_path):
    """A number before the corners, a list and a number after them."""
    header, body = ply([]).split(b"element face 0\n" + LISTS.encode() + b"end_header\n")
    header += b"element face 7\nproperty short flags\n" + LISTS.encode()
    header += b"property list uchar float texcoord\nproperty double quality\nend_header\n"
    for number, face in enumerate(FACES):
        body += struct.pack(f"<hB{len(face)}I", number, len(face), *face)
        body += struct.pack(f"<B{number}fd", number, *range(number), 0.5)
    vertices, triangles = read(tmp_path / "cube.ply", header + body)
    assert trimesh.Trimesh(vertices, triangles, process=False).volume == pytest.approx(1)


@pytest.mark.parametrize("kind", ["int64", "uint64"])
def test_numbers_of_eight_bytes_and_lists_before_the_faces(tmp_path, kind):
    """Triangles alone, with a number of eight bytes for each vertex; the same as text; and lists of
    another element before the faces."""
    binary = ply([]).partition(b"end_header\n")[0].replace(b"uchar red", kind.encode() + b" id")
    binary = binary.replace(b"face 0", b"face 2") + b"end_header\n"
    rows = b"".join(struct.pack("<3fq", *point, 1) for point in CUBE.tolist())
    rows += struct.pack("<B3IB3I", 3, 0, 1, 2, 3, 1, 2, 3)
    text = binary.replace(b"binary_little_endian", b"ascii")
    text += "".join("{} {} {} 1\n".format(*point) for point in CUBE.tolist()).encode()
    text += b"3 0 1 2\n3 1 2 3\n"
    strip = b"element strip 1\nproperty list uchar int vertex_indices\nelement vertex"
    strips = ply(FACES[5:]).replace(b"element vertex", strip)
    place = strips.index(b"end_header\n") + 11
    strips = strips[:place] + struct.pack("<B3i", 3, 0, 1, 2) + strips[place:]
    for data, faces in ((binary + rows, [(0, 1, 2), (1, 2, 3)]), (text, [(0, 1, 2), (1, 2, 3)])):
        vertices, triangles = read(tmp_path / "cube.ply", data)
        np.testing.assert_array_equal(vertices, CUBE)
        np.testing.assert_array_equal(triangles, faces)
    np.testing.assert_array_equal(read(tmp_path / "cube.ply", strips)[1], FACES[5:])


# A prism over an L: floor and roof of area 3 with a notch, walls of 8 around.
BASE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
PRISM = [(x, y, z) for z in (0, 1) for x, y in BASE]
WALLS = [(i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6) for i in range(6)]


@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("alike", [True, False])
def test_a_prism_over_an_l(tmp_path, first, kind, alike):
    """With what MeshLab writes beside corners and coordinates; its walls are hexagons with corners
    in the middle of their edges where all faces are to be alike."""
    corners, ring = list(PRISM), [(first + i) % 6 for i in range(6)]
    walls = WALLS
    if alike:
        middles = np.array([(np.array(PRISM[w[0]]) + PRISM[w[1]]) / 2 for w in WALLS])
        corners += [tuple(m) for m in np.vstack([middles, middles + np.array([0, 0, 1])])]
        walls = [(w[0], 12 + i, *w[1:3], 18 + i, w[3]) for i, w in enumerate(WALLS)]
    faces = [tuple(ring[::-1]), tuple(i + 6 for i in ring), *walls]
    header = f"ply\nformat {kind} 1.0\ncomment VCGLIB generated\nelement vertex {len(corners)}\n"
    header += "".join(f"property float {axis}\n" for axis in ("nx", "x", "y", "z", "quality"))
    header += f"element face {len(faces)}\nproperty uchar flags\n"
    header += (
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
    )
    text = "".join("0 {} {} {} 0.5\n".format(*corner) for corner in corners)
    text += "".join(f"7 {len(f)} {' '.join(map(str, f))} 2 0.5 0.25\n" for f in faces)
    rows = b"".join(struct.pack("<5f", 0, *corner, 0.5) for corner in corners)
    for f in faces:
        rows += struct.pack(f"<BB{len(f)}iB2f", 7, len(f), *f, 2, 0.5, 0.25)
    body = text.encode() if kind == "ascii" else rows
    vertices, triangles = read(tmp_path / "prism.ply", header.encode() + body)
    np.testing.assert_array_equal(vertices, np.array(corners, np.float32))
    a, b, c = np.moveaxis(vertices[triangles].astype(float), 1, 0)
    assert np.einsum("ij,ij->", np.cross(a, b), c) / 6 == pytest.approx(3)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(14)


@settings(deadline=None)
@given(faces=st.lists(st.lists(st.integers(0, 7), max_size=6, unique=True), max_size=12))
@pytest.mark.parametrize("order", "<>")
def test_each_convex_face_becomes_a_fan(tmp_path_factory, faces, order):
    """Some corners of an octagon in its order."""
    rows = [tuple(sorted(face)) for face in faces]
    angle = np.pi / 4 * np.arange(8)
    data = ply(rows, order)
    place = data.index(b"end_header\n") + 11
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    points = b"".join(struct.pack(f"{order}3fB", *point, 7) for point in ring.tolist())
    path = tmp_path_factory.mktemp("fans") / "faces.ply"
    path.write_bytes(data[:place] + points + data[place + len(points) :])
    fans = [(f[0], *f[i : i + 2]) for f in rows for i in range(1, len(f) - 1)]
    if fans:
        assert mesh_file.read(path)[1].tolist() == [[*fan] for fan in fans]
    else:
        with pytest.raises(SculptError, match="holds no triangles"):
            mesh_file.read(path)


def test_a_comment_ends_no_header(tmp_path):
    data = ply(FACES).replace(b"of a test", b"before end_header and behind it")
    assert read(tmp_path / "cube.ply", data)[1].tolist() == (
        read(tmp_path / "same.ply", ply(FACES))[1].tolist()
    )


@pytest.mark.parametrize("share", [0.9, 0.97, 0.999])
def test_a_file_that_ends_too_early_is_told(tmp_path, share):
    data = ply(FACES)
    with pytest.raises(SculptError, match="is no readable mesh"):
        read(tmp_path / "cube.ply", data[: int(share * len(data))])


def test_more_faces_than_bytes_are_told_at_once(tmp_path):
    data = ply(FACES).replace(b"face 7", b"face 99999999999").replace(LISTS.encode(), b"")
    with pytest.raises(SculptError):
        read(tmp_path / "cube.ply", data)
