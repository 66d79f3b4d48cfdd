# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files of every format, and files that hold no mesh."""

import struct

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.fit.mesh_cleanup import clean
from neural_sculpt_addon.field.mesh import mesh_file
from neural_sculpt_addon.field.mesh.proxy import extract
from tests.field.analytic import ball


@pytest.fixture(scope="module")
def proxy():
    return extract(ball(0.5), 16)


@pytest.mark.parametrize("suffix", mesh_file.SUFFIXES)
def test_what_is_written_is_read(tmp_path, proxy, suffix):
    path = tmp_path / f"ball{suffix}"
    mesh_file.write(path, proxy)
    vertices, triangles = mesh_file.read(path)
    assert triangles.shape == (len(proxy.triangles), 3)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.5, atol=1e-4)
    corners = vertices[triangles]
    expected = proxy.vertices[proxy.triangles]
    np.testing.assert_allclose(corners, expected, atol=1e-6)
    mesh = trimesh.load_mesh(path)  # merges what the format keeps apart
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(np.pi / 6, rel=0.05)


def test_normals_are_written(tmp_path, proxy):
    mesh_file.write(tmp_path / "ball.ply", proxy)
    data = (tmp_path / "ball.ply").read_bytes()
    body = data[data.index(b"end_header\n") + 11 :]
    vertices = np.frombuffer(body, "<f4", 6 * len(proxy.vertices)).reshape(-1, 6)
    np.testing.assert_array_equal(vertices, np.hstack([proxy.vertices, proxy.normals]))
    mesh_file.write(tmp_path / "ball.obj", proxy)
    lines = (tmp_path / "ball.obj").read_text().splitlines()
    normals = [[float(x) for x in line.split()[1:]] for line in lines if line.startswith("vn ")]
    np.testing.assert_allclose(normals, proxy.normals, atol=1e-6)


def test_polygons_become_triangles(tmp_path):
    path = tmp_path / "quad.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    vertices, triangles = mesh_file.read(path)
    assert (vertices.shape, triangles.shape) == ((4, 3), (2, 3))


@pytest.mark.parametrize("corner", ["{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}"])
def test_faces_that_count_back_from_where_they_stand(tmp_path, corner):
    """Two tetrahedra, each with its corners before its faces."""
    faces = [(-4, -2, -3), (-4, -3, -1), (-4, -1, -2), (-3, -2, -1)]
    text, corners = "", []
    for x in (0, 5):
        points = np.array([[x, 0, 0], [x + 1, 0, 0], [x, 1, 0], [x, 0, 1]])
        text += "".join("v {} {} {}\nvt 0 0\nvn 0 0 1\n".format(*point) for point in points)
        for face in faces:
            text += f"f {' '.join(map(corner.format, face))}\n"
            corners.append(points[list(face)])
    (tmp_path / "two.obj").write_text(text)
    vertices, triangles = mesh_file.read(tmp_path / "two.obj")
    np.testing.assert_array_equal(vertices[triangles], corners)


def test_polygons_that_count_back_over_two_lines(tmp_path):
    path = tmp_path / "mixed.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 \\\n-2 -1  # four\nv 2 0 0\nf 2 -1 3\n"
    )
    vertices, triangles = mesh_file.read(path)
    expected = [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]], [[1, 0], [2, 0], [1, 1]]]
    np.testing.assert_array_equal(vertices[triangles][..., :2], expected)


@pytest.mark.parametrize(
    ("vertex", "face"),
    [
        ("v {} {} {}\n", "f {} {} {}  # a face\n"),
        ("v {} {} {} # C:\\\n", "f {} {} {}\n"),
        ("v\t{}\t{} {}\n", "f\t{}\t{} {}\n"),
        (" \tv {} {} {}\n", "  f {} {} {}\n"),
        ("\ufeffv {} {} {}\n", "f {} {} {}\n"),
        ("v {} {} {} 1 0.5 0\r\n", "f {}/ {}// {}\r\n"),
    ],
)
def test_lines_of_obj_files_as_other_programs_write_them(tmp_path, vertex, face):
    """A tetrahedron, with lines and points beside its faces."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    faces = np.array([(1, 3, 2), (1, 2, 4), (1, 4, 3), (2, 3, 4)])
    text = "".join(vertex.format(*corner) for corner in corners).replace("\ufeff", "")
    text += "l 1 2 3\np 4\n" + "".join(face.format(*each) for each in faces)
    text = "\ufeff" * vertex.startswith("\ufeff") + text
    (tmp_path / "tetrahedron.obj").write_bytes(text.encode())
    vertices, triangles = mesh_file.read(tmp_path / "tetrahedron.obj")
    np.testing.assert_array_equal(vertices[triangles], corners[faces - 1])


@pytest.mark.parametrize("suffix", mesh_file.SUFFIXES)
@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.7, 0.99])
def test_truncated_files_are_a_smaller_mesh_or_a_sentence(tmp_path, proxy, suffix, share):
    path = tmp_path / f"cut{suffix}"
    mesh_file.write(path, proxy)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    try:
        vertices, triangles = mesh_file.read(path)
    except SculptError as error:
        assert path.name in str(error)
        assert "\n" not in str(error)
        assert len(str(error)) < 300
        return
    assert share > 0
    assert 0 <= triangles.min() <= triangles.max() < len(vertices)


@pytest.mark.parametrize("suffix", [".ply", ".stl"])
def test_coordinates_that_single_precision_crushed_are_noticed(tmp_path, suffix):
    """A ball of radius 1 that is 1e6 off its origin: steps of 0.06."""
    path = tmp_path / f"far{suffix}"
    trimesh.creation.icosphere(3).apply_translation([1e6, 0, 0]).export(path)
    vertices, triangles = mesh_file.read(path)
    assert vertices.dtype == np.float32
    with pytest.raises(SculptError, match="far from its origin"):
        clean(vertices, triangles)


def test_a_file_of_double_precision_may_be_far_away(tmp_path):
    ball = trimesh.creation.icosphere(3).apply_translation([1e6, 0, 0])
    ball.export(tmp_path / "far.off", digits=16)
    corner = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    rows = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
    header = "ply\nformat ascii 1.0\nelement vertex 4\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    header += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "far.ply").write_text(header + corner.replace("1", "1000001") + rows)
    for name in ("far.off", "far.ply"):
        vertices, triangles = mesh_file.read(tmp_path / name)
        assert vertices.dtype == np.float64
        clean(vertices, triangles)


BAD = {
    "noise.ply": np.random.default_rng(0).bytes(400),
    "noise.stl": np.random.default_rng(1).bytes(400),
    "noise.glb": np.random.default_rng(2).bytes(400),
    "noise.off": np.random.default_rng(3).bytes(400),
    "noise.obj": np.random.default_rng(4).bytes(400),
    "points.obj": b"v 0 0 0\nv 1 0 0\n",
    "outside.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "back.obj": b"v 0 0 0\nv 1 0 0\nf -3 -2 -1\nv 0 1 0\nv 1 1 0\n",
    "words.obj": b"v a b c\nf 1 2 3\n",
    "points.ply": b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    b"property float z\nend_header\n0 0 0\n",
    "outside.ply": b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    b"0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
    "huge.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999999\n"
    b"property float x\nproperty float y\nproperty float z\nend_header\n",
    "huge.stl": bytes(80) + struct.pack("<I", 2**32 - 1),
    "large.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999999\n",
    "infinite.ply": b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
    b"property float y\nproperty float z\nelement face 1\n"
    b"property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\ninf 0 1 2\n",
    "huge.off": b"OFF\n999999999999 1 1\n",
    "none.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"
    b"property float y\nproperty float z\nelement face 999999999999\nend_header\n" + bytes(12),
    "strips.ply": b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
    b"property float y\nproperty float z\nelement tristrips 1\n"
    b"property list int int vertex_indices\nend_header\n0 0 0\n1 0\n",
    "wide.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".encode("utf-16"),
    "odd.obj": b"v 0 0 -1.#IND\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
}


@pytest.mark.parametrize("name", BAD)
def test_files_without_a_mesh(tmp_path, name):
    (tmp_path / name).write_bytes(BAD[name])
    with pytest.raises(SculptError, match=name) as caught:
        mesh_file.read(tmp_path / name)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_other_suffixes_and_absent_files(tmp_path, proxy):
    (tmp_path / "mesh.fbx").touch()
    for action in (mesh_file.read, lambda path: mesh_file.write(path, proxy)):
        with pytest.raises(SculptError, match=r"\.ply, \.obj"):
            action(tmp_path / "mesh.fbx")
    with pytest.raises(SculptError, match="cannot be read"):
        mesh_file.read(tmp_path / "absent.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(SculptError, match=r"folder\.ply"):
        mesh_file.read(tmp_path / "folder.ply")
    with pytest.raises(SculptError, match="cannot be written"):
        mesh_file.write(tmp_path / "absent" / "mesh.ply", proxy)
