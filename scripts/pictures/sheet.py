# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures on a page: labels, curves and rows of them. Arrays (height, width, 3) of bytes; pixels.

Lines are drawn larger and made smaller, so that they are smooth at their edges.
"""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from neural_sculpt_addon.common.whole_file import write_whole

Picture = NDArray[np.uint8]

LABEL = 17  # of the letters
LARGER = 4
INK, PALE = (34, 34, 34), (190, 196, 204)
BLUE = (39, 96, 157)


def font(size: float = LABEL) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The letters of all figures."""
    return ImageFont.load_default(size)


def label(text: str, width: int, height: int = LABEL + 13) -> Picture:
    """A line of text in the middle of a white stripe."""
    page = Image.new("RGB", (width, height), "white")
    ImageDraw.Draw(page).text((width / 2, height / 2), text, INK, font(), anchor="mm")
    return np.array(page)


def curve(
    values: Sequence[float] | NDArray[np.floating],
    size: tuple[int, int],
    low: float = -1.0,
    high: float = 1.0,
    across: float = 1.0,
) -> Picture:
    """Evenly spaced `values` as a curve over a line at zero; `low` and `high` are the borders.

    across: share of the width that the curve takes, in the middle
    """
    width, height = size[0] * LARGER, size[1] * LARGER
    page = Image.new("RGB", (width, height), "white")
    draw, margin = ImageDraw.Draw(page), 2 * LARGER
    y = np.interp(np.asarray(values, float), [low, high], [height - margin, margin])
    x = width / 2 + (width / 2 - margin) * across * np.linspace(-1, 1, len(y))
    zero = float(np.interp(0, [low, high], [height - margin, margin]))
    draw.line([(margin, zero), (width - margin, zero)], PALE, LARGER)
    draw.line(list(zip(x.tolist(), y.tolist(), strict=True)), BLUE, 2 * LARGER, "curve")
    return np.array(page.resize(size, Image.Resampling.LANCZOS))


def arrow(width: int, height: int) -> Picture:
    """To the right."""
    page = Image.new("RGB", (width * LARGER, height * LARGER), "white")
    draw, margin = ImageDraw.Draw(page), 4 * LARGER
    pointed(draw, (margin, height * LARGER / 2), (width * LARGER - margin, height * LARGER / 2))
    return np.array(page.resize((width, height), Image.Resampling.LANCZOS))


def pointed(
    draw: ImageDraw.ImageDraw,
    start: tuple[float, float],
    end: tuple[float, float],
    color: tuple[int, int, int] = INK,
    thick: float = 2 * LARGER,
) -> None:
    """An arrow on a page that is `LARGER`."""
    way = np.subtract(end, start)
    ahead = way / max(float(np.linalg.norm(way)), 1e-9) * 4 * thick
    aside = np.array([-ahead[1], ahead[0]]) / 2.4
    tip, back = np.array(end), np.array(end) - ahead
    draw.line([start, tuple((back + ahead / 4).tolist())], color, round(thick))
    corners = (tip, back + aside, back - aside)
    draw.polygon([tuple(corner.tolist()) for corner in corners], color)


def beside(pictures: Sequence[Picture]) -> Picture:
    """In a row, from the left, middles at one height."""
    height = max(one.shape[0] for one in pictures)
    return np.concatenate([_padded(one, height, one.shape[1]) for one in pictures], axis=1)


def below(pictures: Sequence[Picture]) -> Picture:
    """One below the other, middles on one line."""
    width = max(one.shape[1] for one in pictures)
    return np.concatenate([_padded(one, one.shape[0], width) for one in pictures], axis=0)


def to_width(picture: Picture, width: int) -> Picture:
    """White at its right up to `width`."""
    more = width - picture.shape[1]
    return np.pad(picture, ((0, 0), (0, more), (0, 0)), constant_values=255)


def save(path: Path, picture: Picture) -> None:
    """As PNG, of all its colours: with 256 of them a shaded ball has steps that one sees."""
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "PNG", optimize=True)
    write_whole(path, buffer.getvalue())


def _padded(picture: Picture, height: int, width: int) -> Picture:
    rows, columns = height - picture.shape[0], width - picture.shape[1]
    sides = (rows // 2, rows - rows // 2), (columns // 2, columns - columns // 2), (0, 0)
    return np.pad(picture, sides, constant_values=255)
