# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files of every format, and files that hold no mesh."""

import json
import struct
import tracemalloc
from collections.abc import Iterable
from itertools import combinations
from pathlib import Path
from typing import Any

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


@pytest.mark.parametrize(
    "kind", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing"]
)
def test_files_that_need_more_are_refused_by_name(tmp_path, proxy, kind):
    """As exporters write them: the accessors of a compressed mesh have no bytes of their own."""
    path = tmp_path / "small.glb"
    mesh_file.write(path, proxy)
    header, rest = glb_chunks(path)
    header |= {"extensionsUsed": [kind], "extensionsRequired": [kind]}
    for accessor in header["accessors"]:
        del accessor["bufferView"]
    write_glb(path, header, rest)
    with pytest.raises(SculptError, match=rf"small\.glb needs what cannot be read here \({kind}\)"):
        mesh_file.read(path)


def test_numbers_that_are_not_in_the_file_take_no_memory(tmp_path, proxy):
    """A glTF accessor without bytes of its own is as many zeros as it says: here 0.8 GB of them.
    What has as many as the mesh stays, as exporters write for shape keys that move nothing."""
    path = tmp_path / "zeros.glb"
    mesh_file.write(path, proxy)
    header, rest = glb_chunks(path)
    zeros = {"componentType": 5126, "type": "VEC3", "count": len(proxy.vertices)}
    header["accessors"].append(zeros)
    write_glb(path, header, rest)
    assert len(mesh_file.read(path)[1]) == len(proxy.triangles)
    zeros["count"] = 1 << 26
    write_glb(path, header, rest)
    tracemalloc.start()
    with pytest.raises(SculptError, match="fewer numbers than it says"):
        mesh_file.read(path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 1 << 20


def test_nodes_of_a_scene_lie_where_it_puts_them(tmp_path):
    """A tetrahedron as a strip of triangles, put into a scene by three nodes: moved and enlarged
    with its parent, turned by 90 degrees about Z, and mirrored."""
    points = np.vstack([np.zeros(3), np.eye(3)]).astype("<f4")
    strip = np.array([0, 1, 2, 3, 0, 1], "<u2")
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"children": [1, 2, 3], "scale": [2, 2, 2]},
            {"mesh": 0, "translation": [1, 0, 0]},
            {"mesh": 0, "rotation": [0, 0, 0.5**0.5, 0.5**0.5], "translation": [5, 0, 0]},
            {"mesh": 0, "scale": [1, 1, -1], "translation": [9, 0, 0]},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 5}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12},
        ],
        "buffers": [{"byteLength": 60}],
    }
    body = points.tobytes() + strip.tobytes()
    write_glb(tmp_path / "strips.glb", header, struct.pack("<I4s", 60, b"BIN\0") + body)
    vertices, triangles = mesh_file.read(tmp_path / "strips.glb")
    corners = vertices[triangles]  # (12, 3, 3)
    turned = points[:, [1, 0, 2]] * [-1, 1, 1]
    placed = 2 * np.stack([points, turned, points * [1, 1, -1]])
    placed[..., 0] += np.array([[2], [10], [18]])
    expected = [each[[*face]] for each in placed for face in combinations(range(4), 3)]
    assert as_sets(corners) == as_sets(expected)
    volume = np.einsum("ij,ij->", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) / 6
    assert volume == pytest.approx(-3 * 8 / 6)  # the strip begins with the floor, seen from above


def nodes_of(path, proxy, nodes):
    """Where the proxy lies in a file with these nodes: the lowest and highest corner of each of the
    copies."""
    mesh_file.write(path, proxy)
    header, rest = glb_chunks(path)
    header |= {"nodes": nodes, "scenes": [{"nodes": [0]}], "scene": 0}
    header["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
    header["skins"] = [{"joints": [0]}]
    write_glb(path, header, rest)
    vertices, triangles = mesh_file.read(path)
    corners = vertices[triangles].reshape(-1, 3 * len(proxy.triangles), 3)
    return np.stack([corners.min(axis=1), corners.max(axis=1)])  # (2, N, 3)


def test_meshes_at_cameras_and_below_them_are_there(tmp_path, proxy):
    nodes = [
        {"camera": 0, "mesh": 0, "children": [1], "translation": [1, 0, 0]},
        {"mesh": 0, "scale": [2, 1, 1]},
    ]
    box = np.stack([proxy.vertices.min(axis=0), proxy.vertices.max(axis=0)])
    expected = np.stack([box, box * [2, 1, 1]], axis=1)
    expected[..., 0] += 1
    found = nodes_of(tmp_path / "a.glb", proxy, nodes)
    np.testing.assert_allclose(np.sort(found, axis=1), np.sort(expected, axis=1), atol=1e-6)


def test_a_mesh_with_a_skin_stays_where_its_joints_hold_it(tmp_path, proxy):
    nodes = [{"mesh": 0, "skin": 0, "translation": [7, 0, 0], "scale": [9, 9, 9]}]
    box = np.stack([proxy.vertices.min(axis=0), proxy.vertices.max(axis=0)])
    found = nodes_of(tmp_path / "a.glb", proxy, nodes)
    np.testing.assert_allclose(found, box[:, None], atol=1e-6)


def test_deep_trees_of_nodes_add_up(tmp_path, proxy):
    """Of 3,000 nodes each moves what is below it."""
    nodes = [{"translation": [0, 1, 0], "children": [i + 1]} for i in range(2999)] + [{"mesh": 0}]
    box = np.stack([proxy.vertices.min(axis=0), proxy.vertices.max(axis=0)])
    found = nodes_of(tmp_path / "a.glb", proxy, nodes)
    np.testing.assert_allclose(found, box[:, None] + [0, 2999, 0], atol=1e-3)


@pytest.mark.parametrize("children", [[0], [1, 1]])
def test_nodes_in_a_circle_or_with_two_parents_are_refused(tmp_path, proxy, children):
    with pytest.raises(SculptError, match="two parents"):
        nodes_of(tmp_path / "a.glb", proxy, [{"children": children}, {"mesh": 0}])


def test_more_copies_than_fit_the_memory_are_refused(tmp_path, proxy):
    count = (1 << 26) // len(proxy.vertices)
    nodes = [{"children": list(range(1, count + 1))}, *[{"mesh": 0}] * count]
    with pytest.raises(SculptError, match="decimate them first"):
        nodes_of(tmp_path / "a.glb", proxy, nodes)


def test_numbers_in_another_file_are_told(tmp_path, proxy):
    path = tmp_path / "two.glb"
    mesh_file.write(path, proxy)
    header, rest = glb_chunks(path)
    header["buffers"][0]["uri"] = "two.bin"
    write_glb(path, header, rest)
    with pytest.raises(SculptError, match="in another file"):
        mesh_file.read(path)


@pytest.mark.parametrize("nodes", [True, False])
def test_files_without_a_scene_are_read_whole(tmp_path, proxy, nodes):
    path = tmp_path / "ball.glb"
    mesh_file.write(path, proxy)
    header, rest = glb_chunks(path)
    del header["scenes"]
    header.pop("scene", None)
    header["nodes"] = [{"mesh": 0, "translation": [0, 0, 3]}, {"children": [0]}]
    if not nodes:
        del header["nodes"]
    write_glb(path, header, rest)
    vertices, triangles = mesh_file.read(path)
    expected = proxy.vertices[proxy.triangles] + [0, 0, 3 * nodes]
    np.testing.assert_allclose(vertices[triangles], expected, atol=1e-6)


@pytest.mark.parametrize(
    ("part", "accessor", "why"),
    [
        ({"mode": 6}, {}, "fans of triangles"),
        ({}, {"normalized": True}, "quantized coordinates"),
        ({}, {"sparse": {"count": 1}}, "sparse coordinates"),
    ],
)
def test_what_would_become_another_shape_is_refused(tmp_path, proxy, part, accessor, why):
    path = tmp_path / "odd.glb"
    mesh_file.write(path, proxy)
    header, rest = glb_chunks(path)
    primitive = header["meshes"][0]["primitives"][0]
    primitive |= part
    header["accessors"][primitive["attributes"]["POSITION"]] |= accessor
    write_glb(path, header, rest)
    with pytest.raises(SculptError, match=rf"odd\.glb h(as|olds) {why}.* Export it with"):
        mesh_file.read(path)


def as_sets(faces: Iterable[np.ndarray]) -> set[frozenset[tuple[float, ...]]]:
    """Faces by their corners, in whatever order."""
    return {frozenset(tuple(corner) for corner in face.round(4).tolist()) for face in faces}


def glb_chunks(path: Path) -> tuple[dict[str, Any], bytes]:
    """What a .glb file tells of its data, and all that follows."""
    data = path.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + size]), data[20 + size :]


def write_glb(path: Path, header: dict[str, Any], rest: bytes) -> None:
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    first = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON")
    path.write_bytes(first + text + rest)


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
