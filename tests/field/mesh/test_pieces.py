# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pieces of a proxy nobody asked for, on spheres put together by hand."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.field.mesh.pieces import LEAST, Asked, components, find_islands
from neural_sculpt_addon.field.mesh.proxy import Proxy, extract
from tests.field.analytic import ball

ANY = extract(ball(0.5), 16)  # its lattice is that of a proxy put together; nobody looks at it


def proxy_of(*spheres, inward=()):
    """A proxy of spheres (center, radius); the normals of some point inward, as in a bubble."""
    corners, faces = [], []
    for number, (center, radius) in enumerate(spheres):
        mesh = trimesh.creation.icosphere(min(int(20 * radius), 4), radius)
        faces.append(mesh.faces[:, :: -1 if number in inward else 1] + sum(map(len, corners)))
        corners.append(mesh.vertices + center)
    vertices, triangles = np.concatenate(corners, dtype=np.float32), np.concatenate(faces)
    normals = np.zeros_like(vertices)
    edges = np.arange(len(vertices), dtype=np.int64)
    return Proxy(vertices, normals, triangles, edges, ANY.active, ANY.marched)


def ball_samples(count, center=(0, 0, 0), radius=0.5):
    points = np.random.default_rng(0).normal(size=(count, 3))
    points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
    return (points + center).astype(np.float32)


MAIN = ((0, 0, 0), 0.5)
CRUMB = ((0, 0, 0.53), 0.01)


def asked(before, held=None):
    """The ball, of which the part above z = 0.4 was displaced, but by nothing."""
    points = ball_samples(20_000)
    high = points[:, 2] > 0.4
    return Asked(points[high], points[~high] if held is None else held, before)


def test_one_piece_has_no_islands():
    assert not len(find_islands(proxy_of(MAIN), asked(proxy_of(MAIN))).points)


@pytest.mark.parametrize("inward", [(), (1,)])
def test_a_crumb_of_what_was_displaced_is_an_island(inward):
    """It lies so near to the displaced samples that it attracts its share of them."""
    center = (0, 0, 0.47) if inward else (0, 0, 0.53)
    proxy = proxy_of(MAIN, (center, 0.01), inward=inward)
    islands = find_islands(proxy, asked(proxy_of(MAIN)))
    assert components(proxy) == 2
    assert np.linalg.norm(islands.points - center, axis=1).max() < 0.011
    np.testing.assert_array_equal(np.sign(islands.distance), -1 if inward else 1)
    assert np.abs(islands.distance).min() >= LEAST


def test_a_crumb_of_what_was_to_stay_is_an_island():
    """It lies so near to the samples that are held that it attracts its share of them."""
    crumb = (0, 0.503, 0), 0.005
    proxy = proxy_of(MAIN, crumb)
    islands = find_islands(proxy, asked(proxy_of(MAIN)))
    assert len(islands.points) == len(proxy_of(crumb).vertices)
    before = proxy_of(MAIN, crumb)
    held = np.concatenate([ball_samples(20_000), ball_samples(20, *crumb)])
    assert not len(find_islands(proxy, asked(before, held)).points)


def test_a_piece_that_is_cut_off_stays():
    """A thin bridge joined it to the rest, here a triangle."""
    other = (0.8, 0, 0), 0.1
    after = proxy_of(MAIN, other)
    bridge = [0, 1, len(after.vertices) - 1]
    before = replace(after, triangles=np.concatenate([after.triangles, [bridge]]))
    held = np.concatenate([ball_samples(20_000), ball_samples(1000, *other)])
    assert components(before) == 1
    assert not len(find_islands(after, asked(before, held)).points)


def test_what_was_there_before_stays():
    other = (-0.8, 0, 0), 0.1
    held = np.concatenate([ball_samples(20_000), ball_samples(1000, *other)])
    proxy = proxy_of(MAIN, other)
    assert not len(find_islands(proxy, asked(proxy, held)).points)


def test_what_the_stroke_covers_wholly_stays():
    proxy = proxy_of(MAIN, CRUMB)
    covered = Asked(ball_samples(500, *CRUMB), ball_samples(20_000), proxy)
    assert not len(find_islands(proxy, covered).points)
