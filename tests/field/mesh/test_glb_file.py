# SPDX-License-Identifier: GPL-3.0-or-later
"""GLB files as other programs write them: trees of nodes, and what is refused."""

import json
import struct
import tracemalloc
from collections.abc import Iterable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.mesh import mesh_file
from neural_sculpt_addon.field.mesh.proxy import extract
from tests.field.analytic import ball


@pytest.fixture(scope="module")
def proxy():
    return extract(ball(0.5), 16)


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


def boxes_of(path, proxy, nodes):
    """The boxes (2, N, 3) around the copies of the proxy in a file with these nodes."""
    mesh_file.write(path, proxy)
    header, rest = glb_chunks(path)
    header |= {"nodes": nodes, "scenes": [{"nodes": [0]}], "scene": 0}
    header["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
    header["skins"] = [{"joints": [0]}]
    write_glb(path, header, rest)
    vertices, triangles = mesh_file.read(path)
    corners = vertices[triangles].reshape(-1, 3 * len(proxy.triangles), 3)
    return np.stack([corners.min(axis=1), corners.max(axis=1)])


def test_meshes_at_cameras_and_below_them_are_there(tmp_path, proxy):
    nodes = [
        {"camera": 0, "mesh": 0, "children": [1], "translation": [1, 0, 0]},
        {"mesh": 0, "scale": [2, 1, 1]},
    ]
    box = np.stack([proxy.vertices.min(axis=0), proxy.vertices.max(axis=0)])
    expected = np.stack([box, box * [2, 1, 1]], axis=1)
    expected[..., 0] += 1
    found = boxes_of(tmp_path / "a.glb", proxy, nodes)
    np.testing.assert_allclose(np.sort(found, axis=1), np.sort(expected, axis=1), atol=1e-6)


def test_a_mesh_with_a_skin_stays_where_its_joints_hold_it(tmp_path, proxy):
    nodes = [{"mesh": 0, "skin": 0, "translation": [7, 0, 0], "scale": [9, 9, 9]}]
    box = np.stack([proxy.vertices.min(axis=0), proxy.vertices.max(axis=0)])
    found = boxes_of(tmp_path / "a.glb", proxy, nodes)
    np.testing.assert_allclose(found, box[:, None], atol=1e-6)


def test_deep_trees_of_nodes_add_up(tmp_path, proxy):
    """Each of 3,000 nodes is the parent of the next one and moves it."""
    nodes = [{"translation": [0, 1, 0], "children": [i + 1]} for i in range(2999)] + [{"mesh": 0}]
    box = np.stack([proxy.vertices.min(axis=0), proxy.vertices.max(axis=0)])
    found = boxes_of(tmp_path / "a.glb", proxy, nodes)
    np.testing.assert_allclose(found, box[:, None] + [0, 2999, 0], atol=1e-3)


@pytest.mark.parametrize("children", [[0], [1, 1]])
def test_nodes_in_a_circle_or_with_two_parents_are_refused(tmp_path, proxy, children):
    with pytest.raises(SculptError, match="two parents"):
        boxes_of(tmp_path / "a.glb", proxy, [{"children": children}, {"mesh": 0}])


def test_more_copies_than_fit_the_memory_are_refused(tmp_path, proxy):
    count = (1 << 26) // len(proxy.vertices)
    nodes = [{"children": list(range(1, count + 1))}, *[{"mesh": 0}] * count]
    with pytest.raises(SculptError, match="decimate them first"):
        boxes_of(tmp_path / "a.glb", proxy, nodes)


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
