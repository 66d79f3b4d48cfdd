# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pictures of profiles, modulations and alphas, drawn when they are first needed."""

from collections.abc import Callable
from typing import Any

import bpy
import bpy.utils.previews
import numpy as np
from numpy.typing import NDArray

from ...interaction.preset_file import BOUNDS, CORNER_HANDLE, Preset
from ...stroke.alpha import Alpha

SIZE = 64  # pixels
LINE_WIDTH = 2.2  # pixels
FILL_COLOR = (0.85, 0.55, 0.25, 0.45)  # RGBA, between the curve and zero
DRAWN = (1.0, 0.75, 0.4, 1.0)

_previews: Any = None


def icon(key: str, kind: str, values: NDArray[np.float64]) -> int:
    """The icon of a curve that is sampled uniformly; `key` names it for ever. 0 without a window.

    Cheap from the second time on, so it may be called while drawing.
    """
    return _icon(key, lambda: draw(kind, values))


def alpha_icon(alpha: Alpha) -> int:
    """The icon of an alpha, as of `icon`."""
    return _icon(f"alpha {hash(alpha)}", lambda: draw_alpha(alpha))


def _icon(key: str, draw: Callable[[], NDArray[np.float32]]) -> int:
    if _previews is None:
        return 0
    if key not in _previews:
        preview = _previews.new(key)
        flat = draw().ravel()
        preview.icon_size = preview.image_size = (SIZE, SIZE)
        preview.icon_pixels_float.foreach_set(flat)
        preview.image_pixels_float.foreach_set(flat)
    return _previews[key].icon_id


def sample(preset: Preset) -> NDArray[np.float64]:
    """An approximation of the widget's curve of a preset: straight beside corners, smooth
    elsewhere."""
    x, y = np.array(preset.points).T  # (K,)
    corner = np.array([handle == CORNER_HANDLE for handle in preset.handles])
    chords = np.diff(y) / np.diff(x)  # (K - 1,)
    slopes = np.gradient(y) / np.gradient(x)
    slopes[1:-1][chords[:-1] * chords[1:] <= 0] = 0.0  # no overshoot at a peak
    start, end = (np.where(corner[s], chords, slopes[s]) for s in (slice(-1), slice(1, None)))
    at = np.linspace(*BOUNDS[preset.kind], 4 * SIZE)
    k = np.clip(np.searchsorted(x, at, "right") - 1, 0, len(x) - 2)
    width = np.diff(x)[k]
    t = np.clip((at - x[k]) / width, 0, 1)
    return (
        y[k] * (1 + 2 * t) * (1 - t) ** 2
        + start[k] * width * t * (1 - t) ** 2
        + y[k + 1] * t**2 * (3 - 2 * t)
        - end[k] * width * t**2 * (1 - t)
    )


def draw(kind: str, values: NDArray[np.float64]) -> NDArray[np.float32]:
    """The picture (SIZE, SIZE, 4) of a curve, its first row at the bottom."""
    low, high = BOUNDS[kind]
    high = max(high, float(values.max()))  # a modulation may go beyond its widget
    margin, span = 0.08, 0.84
    column = np.linspace(0, 1, SIZE)
    height = np.interp(column, np.linspace(0, 1, len(values)), values)
    y = (margin + span * (height - low) / (high - low)) * SIZE  # (SIZE,)
    zero = (margin + span * (0 - low) / (high - low)) * SIZE
    rows = np.arange(SIZE)[:, None] + 0.5  # (SIZE, 1)
    slope = np.gradient(y)
    ink = np.clip(LINE_WIDTH / 2 + 0.5 - np.abs(rows - y) / np.hypot(1, slope), 0, 1)[..., None]
    inside = ((rows > np.minimum(y, zero)) & (rows < np.maximum(y, zero)))[..., None]
    picture = np.where(inside, FILL_COLOR, 0.0)
    return (picture * (1 - ink) + np.array(DRAWN) * ink).astype(np.float32)


def draw_alpha(alpha: Alpha) -> NDArray[np.float32]:
    """The picture (SIZE, SIZE, 4) of an alpha, its first row at the bottom."""
    middles = (np.arange(SIZE) + 0.5) * 2 / SIZE - 1
    left, ahead = np.meshgrid(-middles, middles)
    picture = np.ones((SIZE, SIZE, 4), np.float32)
    picture[..., :3] = alpha(ahead.ravel(), left.ravel()).reshape(SIZE, SIZE, 1)
    return picture


def register() -> None:
    """Keep pictures from now on."""
    global _previews  # noqa: PLW0603 - Blender's own collection, there while we are registered
    if not bpy.app.background:
        _previews = bpy.utils.previews.new()


def unregister() -> None:
    """Drop them."""
    global _previews  # noqa: PLW0603
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
        _previews = None
