# SPDX-License-Identifier: GPL-3.0-or-later
"""A brushed part of a proxy is absorbed as the whole mesh would be, and only there."""

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.detail import SUPPORT, cells_of, linear, support
from neural_sculpt_addon.field.edit.absorb import absorb
from neural_sculpt_addon.field.edit.brushed import Brushed, absorb_brushed
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.projection import find_surface


def cut(before, after, triangles):
    """The patch (and its vertices) that Blender sends of a proxy that was brushed."""
    changed = (before != after).any(axis=1)
    ring = changed.copy()
    ring[triangles[changed[triangles].any(axis=1)]] = True
    used, corners = np.unique(triangles[ring[triangles].any(axis=1)], return_inverse=True)
    corners = corners.reshape(-1, 3).astype(np.int32)
    return used, Brushed(before[used], after[used], corners)


def fall(proxy, center, radius):
    """How strongly a brush acts on each vertex (V, 1)."""
    share = np.linalg.norm(proxy.vertices - center, axis=1) / radius
    return (np.clip(1 - share**2, 0, None) ** 2)[:, None].astype(np.float32)


def inflated(proxy, center, radius):
    return proxy.vertices + 0.2 * radius * fall(proxy, center, radius) * proxy.normals


def grabbed(proxy, center, radius):
    way = radius * np.array([0.3, 0.5, 0.4], np.float32)
    return proxy.vertices + fall(proxy, center, radius) * way


def creased(proxy, center, radius):
    share = np.linalg.norm(proxy.vertices - center, axis=1) / radius
    deep = np.clip(1 - share, 0, None)[:, None].astype(np.float32)
    return proxy.vertices - 0.3 * radius * deep * proxy.normals


@pytest.fixture(scope="module", params=["sphere", "suzanne"])
def shape(request):
    preparation = prepare(primitive(request.param))
    return preparation, extract(preparation.field, 160)


@pytest.mark.parametrize("brush", [inflated, grabbed, creased])
def test_a_dab_is_taken_in_and_nothing_else_changes(shape, brush):
    preparation, proxy = shape
    generator = np.random.default_rng(1)
    for center in proxy.vertices[generator.integers(len(proxy.vertices), size=2)]:
        after = brush(proxy, center, generator.uniform(0.08, 0.15))
        _, brushed = cut(proxy.vertices, after, proxy.triangles)
        done = absorb_brushed(preparation, brushed)
        field = done.preparation.field
        changed = (after != proxy.vertices).any(axis=1)
        assert find_surface(field, after[changed]).distance.mean() < 1.5e-4
        assert find_surface(field, proxy.vertices[~changed]).distance.mean() < 2e-5
        assert done.report["components_after"] == done.report["components_before"]
        points = generator.uniform(-1, 1, (20_000, 3)).astype(np.float32)
        beyond = ~np.isin(linear(cells_of(points, SUPPORT), SUPPORT), support(done.layer))
        before = values(preparation.field, points[beyond])
        assert np.array_equal(values(field, points[beyond]), before)


def test_a_dab_by_its_region_is_that_by_the_whole_mesh(shape):
    preparation, proxy = shape
    center = proxy.vertices[np.argmax(proxy.vertices[:, 2])]
    after = inflated(proxy, center, 0.15)
    whole = absorb(preparation.field, after, proxy.triangles).field
    _, brushed = cut(proxy.vertices, after, proxy.triangles)
    part = absorb_brushed(preparation, brushed).preparation
    near = np.linalg.norm(part.proxy.vertices - center, axis=1) < 0.2
    assert find_surface(whole, part.proxy.vertices[near]).distance.mean() < 1e-4


def test_vertices_are_put_onto_the_field(shape):
    preparation, proxy = shape
    center = proxy.vertices[np.argmax(proxy.vertices[:, 2])]
    after = inflated(proxy, center, 0.12)
    _, brushed = cut(proxy.vertices, after, proxy.triangles)
    done = absorb_brushed(preparation, brushed)
    snapped = done.snapped
    assert done.is_shown
    assert np.abs(values(done.preparation.field, snapped.vertices)).max() < 1e-4
    still = (brushed.before == brushed.after).all(axis=1)
    assert np.abs(snapped.vertices - brushed.after)[still].max() < 1e-4
    np.testing.assert_allclose(np.linalg.norm(snapped.normals, axis=1), 1, atol=1e-5)


def test_stretched_triangles_are_not_kept(shape):
    preparation, proxy = shape
    center = proxy.vertices[np.argmax(proxy.vertices[:, 2])]
    after = proxy.vertices + 4 * (grabbed(proxy, center, 0.08) - proxy.vertices)
    _, brushed = cut(proxy.vertices, after, proxy.triangles)
    done = absorb_brushed(preparation, brushed)
    assert not done.is_shown
    off = np.linalg.norm(done.snapped.vertices - brushed.after, axis=1)
    assert off.mean() < 3e-4


def test_what_cannot_be_absorbed_says_why(shape):
    preparation, proxy = shape
    after = proxy.vertices.copy()
    _, brushed = cut(after, after + 1e-3, proxy.triangles[:100])
    with pytest.raises(SculptError, match="nothing to absorb"):
        absorb_brushed(preparation, brushed._replace(after=brushed.before))
    with pytest.raises(SculptError, match="leaves the box"):
        absorb_brushed(preparation, brushed._replace(after=3 * brushed.after))
