# SPDX-License-Identifier: GPL-3.0-or-later
"""The alpha: a grey image that a stroke has as its relief, once of a dab, in a row along a stroke.

An image is a square of two radii by two. Up is the direction of the stroke, right its right: the
side on which v is negative. Its grey values, 0 to 1, are coefficients of quadratic B-splines in the
middles of its pixels, so the relief is C1, stays within 0 and 1, and has no cliff: beyond the image
it fades to 0 within two pixels. Two kinds of images are told apart by their edges. What is black
there, as a rivet, stands alone: a row has whole ones only. What is not, as skin, is a pattern: its
opposite edges are taken to join, and a row of it goes on to where the stroke ends. Images that
stand alone or apart are turned each by itself; a pattern is turned as a whole, with rows side by
side, and leaves no gaps. Lengths are in radii of the stroke.
"""

import base64
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import reading
from ..common.errors import SculptError
from .alpha_images import IMAGES

Array = NDArray[np.float64]

LEAST_SIZE, LARGEST_SIZE = 2, 128  # pixels along a side: one edit holds no finer relief
NAMED_SIZE = 64  # of those that come with the extension
LEAST_SPACING, LARGEST_SPACING = 0.25, 16.0  # radii
LARGEST_ANGLE = 360.0  # degrees
NATURAL_SPACING = 2.0  # an image begins where the one before it ends
LEAST_SCALE = 0.25  # of a pattern on a closed stroke, which then is no longer than a dab
BLACK = 0.03  # of the edges of images that stand alone: photographs are not black altogether
PADDING = 4  # pixels around an image: those at the opposite edge, then black


@dataclass(frozen=True)
class Alpha:
    """Exactly one of `name` and `pixels` is given.

    name:    one of IMAGES
    pixels:  (size * size,) bytes, 0 black to 255 white, rows from the top
    angle:   degrees by which the image is turned, counter-clockwise seen from outside
    spacing: radii from one image to the next along a stroke; where they overlap the lighter wins
    flipped: left and right are exchanged, before it is turned
    """

    name: str = ""
    pixels: bytes = b""
    angle: float = 0.0
    spacing: float = NATURAL_SPACING
    flipped: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no image. SculptError."""
        if bool(self.name) == bool(self.pixels):
            raise SculptError("An alpha needs one of: a name, pixels.")
        if self.name and self.name not in IMAGES:
            names = ", ".join(IMAGES)
            raise SculptError(
                "There is no alpha named {}; choose one of {}.", f"{self.name!r:.100}", names
            )
        size = math.isqrt(len(self.pixels))
        if self.pixels and (size**2 != len(self.pixels) or not LEAST_SIZE <= size <= LARGEST_SIZE):
            raise SculptError(
                "An alpha is a square of {} to {} pixels along a side.", LEAST_SIZE, LARGEST_SIZE
            )
        if not abs(self.angle) <= LARGEST_ANGLE:
            raise SculptError(
                "The angle of an alpha is {}; it must lie between -360 and 360.",
                f"{self.angle:.6g}",
            )
        if not LEAST_SPACING <= self.spacing <= LARGEST_SPACING:
            raise SculptError(
                "The spacing of an alpha is {}; it must lie between {} and {} radii.",
                f"{self.spacing:.6g}",
                f"{LEAST_SPACING:g}",
                f"{LARGEST_SPACING:g}",
            )

    def __call__(self, ahead: ArrayLike, left: ArrayLike) -> Array:
        """Grey values (M,) of one image at places (M,) ahead and to the left of its middle."""
        ahead, right = np.asarray(ahead, float), -np.asarray(left, float)
        cosine, sine = self._turn
        x, y = cosine * right + sine * ahead, cosine * ahead - sine * right
        image = _image(self.name, self.pixels)
        half = (len(image) - 2 * PADDING) / 2
        column = (1 + (-x if self.flipped else x)) * half - 0.5 + PADDING
        return _spline(image, (1 - y) * half - 0.5 + PADDING, column)

    def along(
        self, along: Array, left: Array, length: float, closed: bool = False, inset: float = 0.0
    ) -> Array:
        """Grey values (M,) in the row of images of a stroke, at places (M,) from its start on.

        length: of the stroke, in radii; 0 of a dab, which has one image
        closed: the images are moved together or apart so that a whole number of them fits; a
                pattern is made a little smaller or larger instead
        inset:  of images that stand alone the first and the last lie this far from its ends
        """
        pattern = length > 0 and _is_pattern(self.name, self.pixels)
        if pattern and self.spacing <= NATURAL_SPACING and (closed or self.angle % 90):
            return self._tiled(along - inset, left, length if closed else math.inf)
        first, step, count = inset, self.spacing, 1
        if closed:
            step = max(length / max(round(length / step), 1), LEAST_SPACING)
        elif length < 2 * inset:
            first = length / 2
        else:
            count = math.floor((length - 2 * inset) / step + 1e-6) + 1
        endless = closed or pattern
        size = len(_image(self.name, self.pixels)) - 2 * PADDING
        reach = (1 + 4 / size) * sum(map(abs, self._turn))  # from the middle of an image
        value = np.zeros(len(along))
        lowest = np.ceil((along - first - reach) / step)
        for number in range(math.floor(2 * reach / step) + 1):
            place = lowest + number
            ahead = along - first - place * step
            there = ahead >= -reach
            if not endless:
                there &= (place >= 0) & (place < count)
            some = np.flatnonzero(there)
            value[some] = np.maximum(value[some], self(ahead[some], left[some]))
        return value

    def _tiled(self, ahead: Array, left: Array, length: float) -> Array:
        """Grey values (M,) of rows that are turned by what the angle is off the next quarter turn.

        length: after which they are the same again, for which they are scaled and turned a little;
                infinite where that need not be
        """
        quarters, scale = round(self.angle / 90), 1.0
        turn = math.radians(self.angle - 90 * quarters)
        step, row = self.spacing, NATURAL_SPACING
        if length < math.inf:
            steps = max(round(length * math.cos(turn) / step), 1)
            rows = round(length * math.sin(turn) / row)
            turn = math.atan2(rows * row, steps * step)
            scale = max(length / math.hypot(steps * step, rows * row), LEAST_SCALE)
        image = replace(self, angle=90.0 * quarters)
        x = (math.cos(turn) * ahead + math.sin(turn) * left) / scale
        y = (math.cos(turn) * left - math.sin(turn) * ahead) / scale
        reach = 1 + 4 / (len(_image(self.name, self.pixels)) - 2 * PADDING)
        value = np.zeros(len(x))
        for dx in _from_images(x, step, reach):
            for dy in _from_images(y, row, reach):
                some = np.flatnonzero((dx >= -reach) & (dy >= -reach))
                value[some] = np.maximum(value[some], image(dx[some], dy[some]))
        return value

    @property
    def feature(self) -> float:
        """Half the length in radii of a wave that is as steep as the image on average; infinite
        where that is of one grey."""
        inner = slice(PADDING, -PADDING)
        image = _image(self.name, self.pixels)[inner, inner]
        slopes = np.mean(np.diff(image, axis=0) ** 2) + np.mean(np.diff(image, axis=1) ** 2)
        if slopes == 0:
            return math.inf
        return float(np.pi * image.std() / np.sqrt(slopes)) * 2 / len(image)

    def mirrored(self) -> "Alpha":
        """The image with left and right exchanged, as it lies in the stroke."""
        return replace(self, angle=0.0 - self.angle, flipped=not self.flipped)

    def to_json(self) -> dict[str, Any]:
        """Plain data for a stroke file; what has its default value is left out."""
        data: dict[str, Any] = {"name": self.name} if self.name else {"pixels": _text(self.pixels)}
        if self.angle:
            data["angle"] = self.angle
        if self.spacing != NATURAL_SPACING:
            data["spacing"] = self.spacing
        if self.flipped:
            data["flipped"] = True
        return data

    @staticmethod
    def from_json(data: object) -> "Alpha":
        """Read what `to_json` wrote. SculptError when it is something else."""
        if not isinstance(data, Mapping) or set(data) - _WORDS:
            raise SculptError(
                'An alpha is {"name"} or {"pixels"}, with an angle, a spacing, or flipped.'
            )
        try:
            return Alpha(
                name=reading.text(data.get("name", "")),
                pixels=_bytes(reading.text(data.get("pixels", ""))),
                angle=reading.number(data.get("angle", 0.0)),
                spacing=reading.number(data.get("spacing", NATURAL_SPACING)),
                flipped=reading.flag(data.get("flipped", False)),
            )
        except reading.UNREADABLE as error:
            raise SculptError("An alpha cannot be read ({}).", f"{error!s:.100}") from error

    @property
    def _turn(self) -> tuple[float, float]:
        """Cosine and sine of the angle."""
        return math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))


_WORDS = {"name", "pixels", "angle", "spacing", "flipped"}


def pixels_of(grey: ArrayLike) -> bytes:
    """The `pixels` of an image (H, W) of grey values 0 to 1, its first row on top.

    A large one is reduced, each pixel to the mean of its area; an oblong one gets black borders.
    SculptError when it holds no numbers, or all of it is black.
    """
    grey = np.asarray(grey, float)
    if grey.ndim != 2 or not grey.size or not np.isfinite(grey).all():
        raise SculptError("The image holds no grey values. Choose another one.")
    longest = max(grey.shape)
    size = min(max(longest, LEAST_SIZE), LARGEST_SIZE)
    rows, columns = (max(round(size * side / longest), 1) for side in grey.shape)
    small = _reduced(_reduced(np.clip(grey, 0, 1), rows).T, columns).T
    square = np.zeros((size, size), np.uint8)
    top, left = (size - rows) // 2, (size - columns) // 2
    square[top : top + rows, left : left + columns] = np.round(255 * small)
    if not square.any():
        raise SculptError("The image is black, so its stroke would do nothing. Choose another one.")
    return square.tobytes()


def _reduced(image: Array, rows: int) -> Array:
    """The image (H, W) with another number of rows, each the mean of what it covers."""
    height = len(image)
    if rows == height:
        return image
    sums = np.concatenate([np.zeros((1, image.shape[1])), np.cumsum(image, axis=0)])
    edges = np.linspace(0, height, rows + 1)
    whole = np.minimum(edges.astype(int), height - 1)
    covered = sums[whole] + (edges - whole)[:, None] * image[whole]
    return np.diff(covered, axis=0) * rows / height


def _from_images(x: Array, step: float, reach: float) -> list[Array]:
    """How far x (M,) lies ahead of each of the images around it, `step` apart, the first at 0; a
    number below -reach is of an image that does not reach it."""
    lowest = np.ceil((x - reach) / step)
    return [x - (lowest + number) * step for number in range(math.floor(2 * reach / step) + 1)]


@lru_cache(maxsize=64)
def _image(name: str, pixels: bytes) -> Array:
    """Grey values (N + 2 PADDING, N + 2 PADDING), rows from the top."""
    if name:
        middles = (np.arange(NAMED_SIZE) + 0.5) * 2 / NAMED_SIZE - 1
        grey = np.clip(IMAGES[name](*np.meshgrid(middles, -middles)), 0, 1)
    else:
        size = math.isqrt(len(pixels))
        grey = np.frombuffer(pixels, np.uint8).reshape(size, size) / 255
    image = np.pad(np.pad(grey, 1, mode="wrap"), PADDING - 1)
    image.setflags(write=False)
    return image


@lru_cache(maxsize=64)
def _is_pattern(name: str, pixels: bytes) -> bool:
    """Whether an image goes on beyond its edges; one that is black there stands alone."""
    sides = [PADDING - 1, -PADDING]
    image = _image(name, pixels)
    return bool((image[sides] > BLACK).any() or (image[:, sides] > BLACK).any())


def _spline(image: Array, row: Array, column: Array) -> Array:
    """Quadratic B-splines with the coefficients of an image, at places (M,) in pixels."""
    row, column = (np.clip(place, 1, len(image) - 2) for place in (row, column))
    i, j = np.rint(row).astype(np.intp), np.rint(column).astype(np.intp)
    flat, start = image.ravel(), (i - 1) * len(image) + j - 1
    down, right = _weights(row - i), _weights(column - j)
    value = np.zeros(len(row))
    for k in range(3):
        line = sum(right[m] * flat[start + (k * len(image) + m)] for m in range(3))
        value += down[k] * line
    return value


def _weights(t: Array) -> tuple[Array, Array, Array]:
    """Weights (N,) of the splines before, at and after the nearest node, at t in [-1/2, 1/2] from
    it."""
    return (0.5 - t) ** 2 / 2, 0.75 - t**2, (0.5 + t) ** 2 / 2


@lru_cache(maxsize=64)
def _text(pixels: bytes) -> str:
    return base64.b64encode(zlib.compress(pixels, 9)).decode("ascii")


@lru_cache(maxsize=64)
def _bytes(text: str) -> bytes:
    """The pixels that `_text` wrote; at most one byte too many. ValueError when damaged."""
    if not text:
        return b""
    try:
        packed = base64.b64decode(text, validate=True)
        pixels = zlib.decompressobj().decompress(packed, LARGEST_SIZE**2 + 1)
    except zlib.error as error:
        raise ValueError(error) from error
    if not pixels:
        raise ValueError("there are no pixels")
    return pixels
