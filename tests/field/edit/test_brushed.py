# SPDX-License-Identifier: GPL-3.0-or-later
"""A brushed part of a proxy is absorbed as the whole mesh would be, and only there."""

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.field.edit.absorb import absorb
from neural_sculpt_addon.field.edit.brushed import absorb_brushed
from neural_sculpt_addon.field.edit.brushed_surface import Brushed, brushed_surface
from neural_sculpt_addon.field.edit.edit import sculpt
from neural_sculpt_addon.field.evaluate import values
from neural_sculpt_addon.field.levels import SUPPORT, cells_of, linear, support
from neural_sculpt_addon.field.mesh.proxy import extract
from neural_sculpt_addon.field.mesh.surface import sample_surface
from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.field.projection import find_surface
from neural_sculpt_addon.stroke.stroke import Stroke


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


def test_what_the_field_cannot_hold_is_told(shape):
    """A brush that drags the surface over itself, and none that moves it less."""
    preparation, proxy = shape
    middle = np.argmax(proxy.vertices[:, 2])
    center, normal = proxy.vertices[middle], proxy.normals[middle]
    along = np.cross(normal, [0, 1, 0]).astype(np.float32)
    along /= np.linalg.norm(along)
    told = []
    for way in (0.04, 0.3):
        after = proxy.vertices + way * fall(proxy, center, 0.12) * along
        _, brushed = cut(proxy.vertices, after, proxy.triangles)
        done = absorb_brushed(preparation, brushed)
        beside = brushed.triangles[brushed.changed[brushed.triangles].any(axis=1)]
        moved = brushed.after[np.unique(beside)]
        off = find_surface(done.preparation.field, moved).distance
        assert done.report["lost_share"] == pytest.approx((off > 3e-4).mean(), abs=0.02)
        told.append((done.report, moved, off))
    report, _, _ = told[0]
    assert report["lost_share"] < 0.02
    assert "notes" not in report
    assert "worst" not in report
    report, moved, off = told[1]
    (note,) = report["notes"]
    assert note.template.startswith("The field lacks {} of what was moved")
    assert note.arguments == (f"{report['lost_share']:.0%}",)
    for place in report["worst"]:
        away = np.linalg.norm(moved - place, axis=1)
        assert away.min() < 1e-4
        assert off[away.argmin()] > 3e-4


def test_narrow_folds_of_stretched_triangles_are_held(shape):
    """Triangles that are dragged far say little of how narrow what they show is."""
    preparation, proxy = shape
    center = proxy.vertices[np.argmax(proxy.vertices[:, 2])]
    after = proxy.vertices + 4 * (grabbed(proxy, center, 0.1) - proxy.vertices)
    _, brushed = cut(proxy.vertices, after, proxy.triangles)
    assert brushed_surface(preparation.field, brushed).finest >= 7


def test_each_middle_of_an_edge_is_a_sample_once_where_a_fine_level_asks(shape):
    preparation, proxy = shape
    center = proxy.vertices[np.argmax(proxy.vertices[:, 2])]
    _, brushed = cut(proxy.vertices, inflated(proxy, center, 0.12), proxy.triangles)
    surface = brushed_surface(preparation.field, brushed)
    np.testing.assert_array_equal(surface.patch.points, brushed.after)  # there is no fine detail
    corners = surface.brushed.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = np.unique(np.sort(corners, axis=1), axis=0)
    ends = brushed.after[edges]
    level = surface.finest
    cells = np.unique(linear(cells_of(ends.mean(axis=1), level), level))
    assert len(surface.between(cells, level - 2).points) == 0
    some, rest = (surface.between(part, level) for part in (cells[::2], cells))
    points = np.concatenate([some.points, rest.points])
    assert len(points) == len(edges)
    assert 0 < len(some.points) < len(edges)
    assert len(surface.between(cells, level).points) == 0
    beside = np.linalg.norm(np.diff(ends, axis=1)[:, 0], axis=1).max()
    nearest = np.linalg.norm(points[:, None] - ends.mean(axis=1)[None], axis=2).min(axis=1)
    assert nearest.max() < 0.1 * beside


def test_a_faint_dab_is_not_lost(shape):
    """It is lower than what is close enough for others."""
    preparation, proxy = shape
    center = proxy.vertices[np.argmax(proxy.vertices[:, 2])]
    after = proxy.vertices + 2e-4 * fall(proxy, center, 0.1) * proxy.normals
    _, brushed = cut(proxy.vertices, after.astype(np.float32), proxy.triangles)
    done = absorb_brushed(preparation, brushed)
    changed = (brushed.before != brushed.after).any(axis=1)
    left = find_surface(done.preparation.field, brushed.after[changed]).distance
    assert left.mean() < 1e-5


def test_what_cannot_be_absorbed_says_why(shape):
    preparation, proxy = shape
    after = proxy.vertices.copy()
    _, brushed = cut(after, after + 1e-3, proxy.triangles[:100])
    with pytest.raises(SculptError, match="nothing to absorb"):
        absorb_brushed(preparation, brushed._replace(after=brushed.before))
    with pytest.raises(SculptError, match="leaves the box"):
        absorb_brushed(preparation, brushed._replace(after=3 * brushed.after))


@pytest.fixture(scope="module")
def engraved():
    """A ball with a wave that is narrower than two cells of the proxy of 128 cells."""
    preparation = prepare(primitive("sphere"))
    angle = np.linspace(0, 1, 30)
    points = 0.6 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    brush = {"radius": 0.022, "intensity": 0.012}
    stroke = Stroke.from_json({"points": points.tolist(), "seed": 1, "name": "", **brush})
    return sculpt(preparation, stroke).preparation


MIDDLE = 0.6 * np.array([np.cos(0.5), np.sin(0.5), 0])  # of the wave


def test_what_is_finer_than_the_proxy_goes_along(engraved):
    way = np.array([0.03, -0.03, 0.04])

    def moved(points):
        share = np.linalg.norm(points - MIDDLE, axis=1) / 0.25
        return (points + (np.clip(1 - share**2, 0, None) ** 2)[:, None] * way).astype(np.float32)

    proxy = engraved.proxy
    _, brushed = cut(proxy.vertices, moved(proxy.vertices), proxy.triangles)
    done = absorb_brushed(engraved, brushed)
    points = sample_surface(engraved.field, proxy, 60_000, 3).points
    points = points[np.linalg.norm(points - MIDDLE, axis=1) < 0.2]
    distance = find_surface(done.preparation.field, moved(points)).distance
    assert distance.mean() < 4e-5
    assert np.percentile(distance, 95) < 1.2e-4


def test_what_a_brush_flattens_is_gone_between_the_vertices(engraved):
    proxy = engraved.proxy
    inner = np.linalg.norm(proxy.vertices - MIDDLE, axis=1) < 0.15
    size = np.linalg.norm(proxy.vertices, axis=1, keepdims=True)
    ball = np.where(inner[:, None], 0.6 * proxy.vertices / size, proxy.vertices)
    _, brushed = cut(proxy.vertices, ball.astype(np.float32), proxy.triangles)
    done = absorb_brushed(engraved, brushed)
    points = sample_surface(done.preparation.field, done.preparation.proxy, 100_000, 3).points
    points = points[np.linalg.norm(points - MIDDLE, axis=1) < 0.12]
    off = np.abs(np.linalg.norm(points, axis=1) - 0.6)
    assert off.mean() < 1.5e-4  # of a wave that was 0.012 high
    assert np.percentile(off, 99) < 1e-3
