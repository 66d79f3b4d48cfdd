# SPDX-License-Identifier: GPL-3.0-or-later
"""Absorbing a sculpted proxy: the change is taken in, the rest stays, a bad proxy is refused."""

import numpy as np
import pytest
import trimesh

from neural_sculpt_addon.field.absorb import absorb
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.field.proxy import extract
from neural_sculpt_addon.stroke.errors import SculptError

TOP = np.array([0, 0, 0.6])


def dented(vertices, normals, height):
    """A smooth bump or dent around the top of the sphere, 0.25 wide."""
    share = np.linalg.norm(vertices - TOP, axis=1) / 0.25
    return vertices + height * (np.clip(1 - share**2, 0, None) ** 2)[:, None] * normals


@pytest.fixture(scope="module")
def sphere():
    network = primitive("sphere")
    return network, extract(network, 64)


@pytest.mark.parametrize("height", [0.08, -0.08])
def test_a_bump_is_taken_in_and_the_rest_stays(sphere, height):
    network, proxy = sphere
    done = absorb(network, dented(proxy.vertices, proxy.normals, height), proxy.triangles)
    ball = trimesh.creation.icosphere(5, radius=0.6).vertices
    target = dented(ball, ball / 0.6, height)
    away = find_surface(done.network, target).distance
    changed = np.linalg.norm(ball - TOP, axis=1) < 0.25
    assert away[changed].mean() < 0.0015
    assert np.percentile(away[changed], 95) < 0.004
    still = np.linalg.norm(ball - TOP, axis=1) > 0.4
    assert away[still].mean() < 6e-4
    assert away[still].max() < 4e-3
    assert done.report["components"] == 1
    assert done.report["error_mean"] < 0.001


def test_a_coarse_proxy_does_not_wear_the_field_down():
    network = primitive("torus")
    proxy = extract(network, 32)  # its facets are off by 2e-3
    vertices = proxy.vertices.copy()
    vertices[np.argmax(vertices[:, 0])] *= 1.02
    done = absorb(network, vertices, proxy.triangles)
    points = extract(network, 64).vertices
    far = points[points[:, 0] < 0.4]
    assert find_surface(done.network, far).distance.mean() < 6e-4


def test_a_proxy_of_another_topology_is_learned_as_it_is(sphere):
    network, _ = sphere
    ball = trimesh.creation.icosphere(4, radius=0.64)
    done = absorb(network, ball.vertices, ball.faces)
    assert find_surface(done.network, ball.vertices).distance.mean() < 0.002


def test_what_cannot_be_absorbed_says_why(sphere):
    network, proxy = sphere
    with pytest.raises(SculptError, match="nothing to absorb"):
        absorb(network, proxy.vertices, proxy.triangles)
    with pytest.raises(SculptError, match="leaves the box"):
        absorb(network, 2 * proxy.vertices, proxy.triangles)
    with pytest.raises(SculptError, match="no faces"):
        absorb(network, proxy.vertices, proxy.triangles[:0])
    half = proxy.triangles[proxy.vertices[proxy.triangles].mean(axis=1)[:, 2] > 0.3]
    with pytest.raises(SculptError, match="sheet"):
        absorb(network, 1.01 * proxy.vertices, half)
