# SPDX-License-Identifier: GPL-3.0-or-later
"""Alphas: their splines against scipy's, rows of them, images of any size, and what is no alpha."""

import base64
import math
import zlib

import numpy as np
import pytest
from scipy.interpolate import BSpline

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.stroke.alpha import LARGEST_SIZE, Alpha, pixels_of
from neural_sculpt_addon.stroke.alpha_images import IMAGES

RANDOM = np.random.default_rng(7)
NOISE = RANDOM.integers(0, 256, (16, 16)).astype(np.uint8)
NOISE[0] = NOISE[-1] = NOISE[:, 0] = NOISE[:, -1] = 0  # it stands alone
WHITE = Alpha(pixels=bytes([255]) * 64)


def noise(**words):
    return Alpha(pixels=NOISE.tobytes(), **words)


def places(count=400, reach=0.9):
    return RANDOM.uniform(-reach, reach, (2, count))


def test_a_white_image_is_one_and_fades_beyond_it():
    ahead, left = places(reach=1.0)
    np.testing.assert_allclose(WHITE(ahead, left), 1, atol=1e-12)
    off = np.linspace(1, 2, 401)
    for beyond in (WHITE(off, 0 * off), WHITE(0 * off, -off)):
        assert (beyond[off > 1.5] == 0).all()  # two pixels of a quarter of a radius
        assert (np.diff(beyond) <= 1e-12).all()
        assert np.abs(np.diff(beyond, 2)).max() < 2e-4  # C1: a kink would leave 0.01


def test_a_ramp_is_linear_with_the_image_upright():
    """Light on top, so light ahead; and light on the right, where left is negative."""
    up = np.repeat(np.linspace(255, 0, 52).round(), 52).astype(np.uint8).tobytes()
    ahead, left = places()
    value = Alpha(pixels=up)(ahead, left)
    np.testing.assert_allclose(value, 0.5 + ahead / 2 * 52 / 51, atol=1e-9)  # 5 greys a pixel
    right = np.tile(np.linspace(0, 255, 52).round(), 52).astype(np.uint8).tobytes()
    value = Alpha(pixels=right)(ahead, left)
    np.testing.assert_allclose(value, 0.5 - left / 2 * 52 / 51, atol=1e-9)


def test_values_are_quadratic_splines_in_the_middles_of_pixels():
    ahead, left = places(50)
    element = BSpline.basis_element([-1.5, -0.5, 0.5, 1.5], extrapolate=False)
    row, column = (1 - ahead) * 8 - 0.5, (1 - left) * 8 - 0.5
    numbers = np.arange(16)
    down = np.nan_to_num(element(row[:, None] - numbers))  # (50, 16)
    aside = np.nan_to_num(element(column[:, None] - numbers))
    expected = np.einsum("pi,ij,pj->p", down, NOISE / 255, aside)
    np.testing.assert_allclose(noise()(ahead, left), expected, atol=1e-12)


@pytest.mark.parametrize("angle", [30.0, 90.0, -145.0])
def test_a_turned_image_has_turned_values(angle):
    """Counter-clockwise: from ahead to the left."""
    ahead, left = places(reach=0.7)
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turned = noise(angle=angle)(c * ahead - s * left, s * ahead + c * left)
    np.testing.assert_allclose(turned, noise()(ahead, left), atol=1e-9)


def test_a_right_angle_turns_the_pixels():
    turned = Alpha(pixels=np.rot90(NOISE).tobytes())
    ahead, left = places()
    np.testing.assert_allclose(noise(angle=90)(ahead, left), turned(ahead, left), atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 20.0, 90.0])
@pytest.mark.parametrize("flipped", [False, True])
def test_the_mirror_image_has_the_same_values_on_the_other_side(angle, flipped):
    alpha = noise(angle=angle, flipped=flipped)
    ahead, left = places()
    np.testing.assert_allclose(alpha.mirrored()(ahead, left), alpha(ahead, -left), atol=1e-12)
    assert alpha.mirrored().mirrored() == alpha


@pytest.mark.parametrize("spacing", [0.7, 2.0, 3.5])
@pytest.mark.parametrize("angle", [0.0, 33.0])
def test_a_row_repeats_with_the_spacing(spacing, angle):
    alpha = noise(spacing=spacing, angle=angle)
    along, left = RANDOM.uniform(3, 10 - spacing, 300), RANDOM.uniform(-1, 1, 300)
    once, again = (alpha.along(along + step, left, 20.0) for step in (0, spacing))
    np.testing.assert_allclose(once, again, atol=1e-9)
    assert np.ptp(once) > 0.3


def test_where_images_overlap_the_lighter_wins():
    alpha = noise(spacing=1.5)
    along, left = RANDOM.uniform(0, 1.5, 300), RANDOM.uniform(-1, 1, 300)
    expected = np.maximum.reduce([alpha(along - at, left) for at in (-1.5, 0, 1.5, 3)])
    np.testing.assert_allclose(alpha.along(along + 3, left, 20.0), expected, atol=1e-12)


def test_images_that_stand_alone_are_whole_and_begin_with_the_stroke():
    along, left = np.linspace(-1, 8, 901), np.zeros(901)
    dots = Alpha("rivet", spacing=2.0).along(along, left, 7.0)
    assert (dots[[100, 300, 500, 700]] > 0.99).all()  # at 0, 2, 4 and 6
    assert dots[(along > 7.1) | (along < -0.9)].max() == 0
    flat = Alpha("rivet", spacing=2.0).along(along, left, 7.0, inset=1.0)
    assert (flat[[200, 400, 600]] > 0.99).all()  # at 1, 3 and 5
    assert flat[(along > 6.1) | (along < 0)].max() == 0
    short = Alpha("star").along(along, left, 1.0, inset=1.0)
    assert abs(short.argmax() - 150) < 3  # one, in the middle


def test_patterns_go_on_beyond_the_ends_without_a_seam():
    along, left = np.meshgrid(np.linspace(-1, 8, 1801), np.linspace(-0.9, 0.9, 19))
    for name in ("scales", "pores", "rope"):
        value = Alpha(name).along(along.ravel(), left.ravel(), 7.0).reshape(along.shape)
        steps = np.abs(np.diff(value, axis=1))
        seams = np.abs(along[0, 1:] % 2 - 1) < 0.02
        assert steps[:, seams].max() < 1.1 * steps[:, ~seams].max(), name
        assert value[:, along[0] > 7.5].max() > 0.5, name


@pytest.mark.parametrize("angle", [10.0, 45.0, 60.0, -30.0, 170.0])
def test_a_turned_pattern_leaves_no_gaps(angle):
    """Grey all over the stroke stays so, and waves go on as waves: sin(2 pi x) across the image,
    one and the same in all of them."""
    along, left = RANDOM.uniform(-1, 21, 4000), RANDOM.uniform(-1, 1, 4000)
    white = Alpha(pixels=bytes([255]) * 1024, angle=angle).along(along, left, 20.0)
    np.testing.assert_allclose(white, 1, atol=1e-9)
    x = (np.arange(128) + 0.5) / 64 - 1
    waves = np.tile(0.5 + 0.45 * np.sin(2 * np.pi * x), (128, 1))
    value = Alpha(pixels=pixels_of(waves), angle=angle).along(along, left, 20.0)
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    across = s * along - c * left  # to the right of the turned image
    np.testing.assert_allclose(value, 0.5 + 0.45 * np.sin(2 * np.pi * across), atol=0.01)


@pytest.mark.parametrize("angle", [30.0, 45.0, -75.0])
@pytest.mark.parametrize("flipped", [False, True])
def test_a_turned_pattern_is_mirrored(angle, flipped):
    alpha = Alpha("scales", angle=angle, flipped=flipped, spacing=1.5)
    along, left = RANDOM.uniform(0, 9, 500), RANDOM.uniform(-1, 1, 500)
    ours, theirs = alpha.along(along, -left, 9.0), alpha.mirrored().along(along, left, 9.0)
    np.testing.assert_allclose(theirs, ours, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0, 100.0])
@pytest.mark.parametrize("length", [9.0, 25.3, 0.3])
def test_a_pattern_closes_without_gaps(angle, length):
    """What lies beside the end lies beside the start, too, though no whole number of them fits."""
    alpha = Alpha("scales", angle=angle)
    white = Alpha(pixels=bytes([255]) * 1024, angle=angle)
    along, left = RANDOM.uniform(-0.5, 0.5, 300), RANDOM.uniform(-1, 1, 300)
    start, end = (alpha.along(along + at, left, length, closed=True) for at in (0, length))
    if length > 1:
        np.testing.assert_allclose(end, start, atol=1e-9)
        assert start.std() > 0.1
        np.testing.assert_allclose(white.along(along, left, length, closed=True), 1, atol=1e-9)
    assert np.isfinite(start).all()


@pytest.mark.parametrize("length", [9.0, 0.3, 1e-9])
def test_a_closed_row_is_seamless(length):
    alpha, left = noise(), RANDOM.uniform(-1, 1, 50)
    start, end = (alpha.along(np.full(50, at), left, length, closed=True) for at in (0, length))
    if length == 9:  # four or five images fit as well; any whole number would do
        np.testing.assert_allclose(start, end, atol=1e-9)
    assert np.isfinite(start).all()


def test_a_dab_has_one_image():
    ahead, left = places(reach=0.99)
    for alpha in (noise(spacing=0.5), Alpha("pores", spacing=0.5)):
        np.testing.assert_allclose(alpha.along(ahead, left, 0.0), alpha(ahead, left), atol=1e-12)


def test_the_feature_of_waves_is_half_their_length():
    """sin(k x): the square means of value and slope differ by k, and half a wave is pi / k."""
    x = (np.arange(128) + 0.5) / 64 - 1
    for waves in (2, 4, 8):
        wave = np.tile(0.5 + 0.5 * np.sin(waves * np.pi * x), (128, 1))
        assert Alpha(pixels=pixels_of(wave)).feature == pytest.approx(1 / waves, rel=0.02)
        both = (wave + wave.T) / 2
        assert Alpha(pixels=pixels_of(both)).feature == pytest.approx(1 / waves, rel=0.02)
    assert WHITE.feature == math.inf


def pore(number, away):
    """A place in a pore of the sequence, `away` from its middle as a share of its size."""
    x, y = number * np.array([0.7548776662, 0.5698402910]) % 1 * 2 - 1
    size = 0.09 + 0.08 * (number * 0.6180339887 % 1)
    return x - away * size, y, 1 - math.exp(-(away**3))


GREYS = {  # at x, y: by the geometry of each image
    "scales": [
        *((0, 0, 0.62), (0, -0.3, 0.89), (0.5, 0.2, 0.89), (-0.5, -0.8, 0.89)),  # towards the tips
        *((0, -0.5, 1.07 * (0.56 - 0.5) / 0.18), (0.98, 0.2, 0.44)),  # on a rim, behind a middle
    ],
    "stitches": [
        *((0, 0.5, 1), (0.5, 0.7, 1), (-0.5, -0.7, 1), (0, 0.625, 0.75), (0.75, 0.7, 0)),
        *((0.625, 0.7, 0.75), (-0.625, 0.3, 0.75)),
    ],
    "pores": [pore(10, 0), pore(10, 0.5), pore(10, 1), pore(14, 1), (-1, -1, 0), (1, 1, 0)],
    "rivet": [(0, 0, 1), (0.35, 0, 1), (0, -0.575, 0.75), (0.48, 0.64, 0), (-0.8, 0, 0)],
    "star": [
        *((0, 0, 1), (0, 0.95, 0), (0, 0.475, 0.5)),
        *((0.4 * np.sin(x), 0.4 * np.cos(x), 0) for x in np.pi / 5 * np.array([1, 3, -1])),
    ],
    "rope": [(0, 0, 0), (0, 0.5, 1), (0, 1 / 6, 0.75), (5 / 7, 0, 1), (-5 / 21, 0, 0.75)],
}


@pytest.mark.parametrize("name", IMAGES)
def test_built_in_images_are_as_drawn(name):
    x, y, grey = np.transpose(GREYS[name])
    np.testing.assert_allclose(np.clip(IMAGES[name](x, y), 0, 1), grey, atol=1e-6)


def test_alphas_are_values():
    assert hash(Alpha("star", angle=20)) == hash(Alpha("star", angle=20.0))


@pytest.mark.parametrize("side", range(4))
def test_an_image_that_is_light_on_one_side_goes_on_beyond_a_stroke_s_end(side):
    grey = np.zeros((16, 16), np.uint8)
    np.rot90(grey, side)[0, 4:-4] = 255  # a view
    ahead, left = np.meshgrid(np.linspace(8, 12, 65), np.linspace(-0.99, 0.99, 65))
    for light, goes_on in ((grey, True), (0 * grey, False)):
        value = Alpha(pixels=light.tobytes()).along(ahead.ravel(), left.ravel(), 5.0)
        assert value.any() == goes_on


@pytest.mark.parametrize("name", IMAGES)
def test_built_in_images_use_the_range_of_greys(name):
    x, y = np.meshgrid(*2 * [(np.arange(64) + 0.5) / 32 - 1])
    value = Alpha(name)(y.ravel(), -x.ravel())
    assert value.min() >= 0
    assert 0.9 < value.max() <= 1
    assert value.std() > 0.15
    assert Alpha(name).feature > 0.1  # coarse enough for an edit of two cells a tenth of a radius


def test_a_large_image_is_reduced_to_means_of_areas():
    """13 x 13 blocks whose pixels differ, of which no one has the block's grey."""
    greys = RANDOM.integers(40, 200, (LARGEST_SIZE, LARGEST_SIZE))
    grain = RANDOM.uniform(-0.1, 0.1, (LARGEST_SIZE, LARGEST_SIZE, 13, 13))
    grain -= grain.mean(axis=(2, 3), keepdims=True)
    large = (greys[..., None, None] / 255 + grain).transpose(0, 2, 1, 3).reshape(2 * [13 * 128])
    pixels = np.frombuffer(pixels_of(large), np.uint8).reshape(LARGEST_SIZE, LARGEST_SIZE)
    np.testing.assert_array_equal(pixels, greys)


def test_an_image_of_odd_size_keeps_its_mean_and_its_place():
    x = np.linspace(0, 1, 301)
    large = np.tile(x, (301, 1))
    pixels = np.frombuffer(pixels_of(large), np.uint8).reshape(128, 128) / 255
    middles = (np.arange(128) + 0.5) / 128
    np.testing.assert_allclose(pixels[5], middles, atol=0.004)


def test_an_oblong_image_gets_black_borders():
    pixels = np.frombuffer(pixels_of(np.ones((10, 40))), np.uint8).reshape(40, 40)
    assert (pixels[15:25] == 255).all()
    assert pixels.sum() == 400 * 255
    small = np.frombuffer(pixels_of([[0.0, 1.0]]), np.uint8).reshape(2, 2)
    assert sorted(small.ravel()) == [0, 0, 0, 255]


@pytest.mark.parametrize("grey", [[], [[]], [1.0], [[math.nan]], [[[1.0]]], [[0.0]], [[-5.0]]])
def test_what_is_no_image_is_refused(grey):
    with pytest.raises(SculptError, match="Choose another"):
        pixels_of(grey)


def packed(data):
    return base64.b64encode(zlib.compress(data)).decode()


@pytest.mark.parametrize(
    "data",
    [
        *(None, [], "scales", {}, {"name": "fur"}, {"name": 1}, {"name": "x" * 5000}),
        *({"name": "star", "pixels": packed(b"\xff" * 4)}, {"name": "star", "tint": 1}),
        *({"name": "star", "angle": bad} for bad in (361, math.nan, "1", None, True, 10**400)),
        *({"name": "star", "spacing": bad} for bad in (0, 0.2, -1, 17, math.inf, "2", None)),
        *({"name": "star", "flipped": bad} for bad in (1, None, "no")),
        *({"pixels": bad} for bad in ("", "?", "é", "AAAA", None, 5, [[0, 1], [1, 0]])),
        *({"pixels": packed(bytes(size))} for size in (0, 1, 3, 5, 129**2, 10**7)),
        {"pixels": base64.b64encode(bytes(16)).decode()},
        {"pixels": packed(RANDOM.bytes(100**2))[:2000]},
    ],
)
def test_what_is_no_alpha_is_refused_in_one_sentence(data):
    with pytest.raises(SculptError) as caught:
        Alpha.from_json(data)
    assert len(str(caught.value)) < 250


@pytest.mark.parametrize(
    "alpha",
    [
        Alpha("scales"),
        noise(),
        noise(angle=-12.5, spacing=0.25, flipped=True),
        Alpha(pixels=RANDOM.bytes(LARGEST_SIZE**2)),
    ],
)
def test_alphas_round_trip(alpha):
    data = alpha.to_json()
    assert Alpha.from_json(data) == alpha
    assert len(str(data)) < 23_000
