# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3DNS baseline: its sampler, its brushes, and an edit of one point."""

import numpy as np
import pytest
from paper.measures.measures import angles
from paper.methods.methods import Scene
from paper.methods.three_dns import BRUSHES, Chain, Points, ThreeDns, bring, disk
from scipy.stats import kstest

from neural_sculpt_addon.field.primitives import primitive
from neural_sculpt_addon.field.problem.prepare import prepare
from neural_sculpt_addon.stroke.brush import Brush
from neural_sculpt_addon.stroke.modulation import Modulation
from neural_sculpt_addon.stroke.profile import Profile
from neural_sculpt_addon.stroke.stroke import Stroke
from tests.field.analytic import ball, plane

RADIUS, HEIGHT = 0.08, 0.06


@pytest.fixture(scope="module")
def scene():
    preparation = prepare(primitive("sphere"))
    return Scene(preparation, preparation.proxy)


def stroke(count, profile="quintic", modulation="identity"):
    turn = np.linspace(0, 0.5, count)
    points = 0.6 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    return Stroke(points, Brush(RADIUS, HEIGHT, Profile(profile), Modulation(modulation)))


def test_the_chain_stays_on_the_surface_and_is_uniform():
    """On a sphere each coordinate is uniform (Archimedes); 5000 samples, at a level of 1e-3."""
    chain = Chain(ball(0.5), 5000, np.random.default_rng(3))
    for _ in range(5):
        chain.step()
    assert len(chain.points) == 5000
    radius = np.linalg.norm(chain.points, axis=1, keepdims=True)
    assert radius == pytest.approx(0.5, abs=1e-4)
    assert angles(chain.normals, chain.points / radius).max() < 0.1
    for axis in chain.points.T:
        assert kstest(axis / 0.5, "uniform", (-1, 2)).pvalue > 1e-3


def test_each_step_of_the_chain_moves_all_samples_a_little():
    chain = Chain(ball(0.5), 500, np.random.default_rng(0))
    before = chain.points
    chain.step()
    way = np.linalg.norm(chain.points - before, axis=1)
    assert way.min() > 0 and way.max() < 0.041
    assert (way**2).mean() == pytest.approx(0.04**2 / 2, rel=0.1)  # uniform on a disk


def test_a_copy_of_the_chain_leaves_it_where_it_is():
    chain = Chain(ball(0.5), 100, np.random.default_rng(0))
    places = chain.points.copy()
    chain.again(np.random.default_rng(1)).step()
    assert np.array_equal(chain.points, places)


def test_disks_are_flat_round_and_even():
    normals = np.array([[0.0, 0, 1], [0.6, 0, 0.8], [1, 0, 0]])
    points = disk(normals, 4000, np.random.default_rng(1))
    assert np.abs(np.einsum("kna,ka->kn", points, normals)).max() < 1e-12
    for one in points:
        rho = np.linalg.norm(one, axis=1)
        assert kstest(rho**2, "uniform").pvalue > 1e-3
        assert np.abs(one.mean(axis=0)).max() < 0.03


@pytest.mark.parametrize("name", BRUSHES)
def test_brushes_are_the_products_profiles(name):
    rho = np.linspace(0, 1, 50)
    assert BRUSHES[name](rho) == pytest.approx(Profile(name)(rho), abs=1e-12)


def test_a_bump_on_a_plane_has_its_closed_form():
    """z = s (1 - 3 q^2 + 2 q^3), q = rho / r: slopes 6 s / r (q^2 - q)."""
    flat = plane(offset=0.1)
    points = Points(np.array([[0.2, 0.1, 0.1]]), np.array([[0.0, 0, 1]]), np.array([HEIGHT]),
                    RADIUS, BRUSHES["cubic"])  # fmt: skip
    random = np.random.default_rng(0)
    places, normals = points.samples(flat, np.array([800]), False, random)
    away = places[:, :2] - [0.2, 0.1]
    rho = np.linalg.norm(away, axis=1)
    q = rho / RADIUS
    assert places[:, 2] == pytest.approx(0.1 + HEIGHT * (1 - 3 * q**2 + 2 * q**3), abs=1e-6)
    slope = 6 * HEIGHT / RADIUS * (q**2 - q)
    expected = np.column_stack([-slope[:, None] * away / rho[:, None], np.ones(len(q))])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert normals == pytest.approx(expected, abs=1e-4)


def test_the_normals_of_a_bump_on_a_ball_are_those_of_finite_differences():
    """The bump is (a, b) -> surface below (a, b) + s b(rho / r) n, in the tangent plane at n."""
    shape = ball(0.5)
    one = Points(np.array([[0.0, 0, 0.5]]), np.array([[0.0, 0, 1]]), np.array([-0.04]), 0.1,
                 BRUSHES["quintic"])  # fmt: skip
    places, normals = one.samples(shape, np.array([300]), False, np.random.default_rng(0))

    def height(x, y):
        q = np.hypot(x, y) / 0.1
        return np.sqrt(0.25 - x**2 - y**2) - 0.04 * (1 - 10 * q**3 + 15 * q**4 - 6 * q**5)

    # Steps along the normal, not down: places lie a little inwards of their disk sample, but on
    # this surface below themselves within the second order.
    x, y, z = places.T
    assert z == pytest.approx(height(x, y), abs=2e-3)
    step = 1e-5
    slopes = [(height(x + step, y) - height(x - step, y)) / (2 * step),
              (height(x, y + step) - height(x, y - step)) / (2 * step)]  # fmt: skip
    expected = np.column_stack([-slopes[0], -slopes[1], np.ones(len(x))])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert angles(normals, expected).max() < 4


def test_points_lie_evenly_along_the_stroke_and_are_modulated(scene):
    points = Points.along(scene.field, stroke(5, modulation="linear"))
    turn = np.arctan2(points.places[:, 1], points.places[:, 0])
    assert turn == pytest.approx(np.linspace(0, 0.5, 5), abs=2e-3)
    assert points.heights == pytest.approx(HEIGHT * np.array([1, 0.75, 0.5, 0.25, 0]))
    assert angles(points.normals, points.places / 0.6).max() < 1


def test_in_a_union_each_place_has_one_bump():
    """Two points half a radius apart on a plane: samples stay on the side of their own point."""
    flat = plane()
    both = Points(np.array([[-0.02, 0, 0], [0.02, 0, 0]]), np.tile([0.0, 0, 1], (2, 1)),
                  np.array([1e-9, 0.05]), RADIUS, BRUSHES["linear"])  # fmt: skip
    counts, random = np.array([2000, 2000]), np.random.default_rng(0)
    places, _ = both.samples(flat, counts, True, random)
    high = places[:, 2] > 1e-6
    assert (places[high, 0] >= -1e-6).all() and (places[~high, 0] <= 1e-6).mean() > 0.99
    every, _ = both.samples(flat, counts, False, random)
    assert len(every) == 4000 > len(places) > 2000


def test_other_profiles_are_refused(scene):
    points = stroke(4).points
    odd = Stroke(points, Brush(RADIUS, HEIGHT, Profile(points=((-1, 0), (0.5, 1), (1, 0)))))
    with pytest.raises(ValueError, match="radial"):
        Points.along(scene.field, odd)


def test_projection_by_the_value_of_a_distance_arrives_at_once():
    start = np.array([[0.3, 0.1, 0.05], [0, 0, -0.02]])
    points, value, normals = bring(plane(), start, 3)
    assert points == pytest.approx(start * [1, 1, 0], abs=1e-6)
    assert np.abs(value).max() < 1e-6
    assert normals == pytest.approx(np.tile([0, 0, 1.0], (2, 1)), abs=1e-6)


@pytest.mark.long
def test_one_point_raises_a_bump(scene):
    """After 60 epochs its middle has risen by most of the height; twice with the same bits."""
    dab = stroke(1)
    method = ThreeDns("3DNS", 60, preserve=4000, box=4000)
    method.prepare(scene)
    one, two = method.edit(scene, dab), method.edit(scene, dab)
    away = one.surface.see(0.6 * np.eye(3)[:2]).distance
    assert away[0] == pytest.approx(HEIGHT, rel=0.35)
    assert away[1] < 5e-3
    assert np.array_equal(one.surface.sample(50, 0), two.surface.sample(50, 0))
