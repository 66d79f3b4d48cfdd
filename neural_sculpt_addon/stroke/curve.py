# SPDX-License-Identifier: GPL-3.0-or-later
"""Control points to a smooth curve, sampled uniformly by arc length.

A C2 cubic spline by chord length: not-a-knot at open ends, periodic when closed (de Boor, "A
Practical Guide to Splines", chapter IV). One distinct point is a curve of length zero. NumPy
float64, any frame.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

REPEATED = 1e-6  # points closer than this are one; fields and proxies are float32
STEPS_PER_SPAN = 24  # chords that measure the length of one span; relative error below 1e-3


@dataclass(frozen=True)
class Curve:
    """A cubic spline through `points`, with `slopes` dp/dt at the knots t.

    A closed curve repeats its first knot at the end.
    """

    knots: Array  # (K,), chord length
    points: Array  # (K, 3)
    slopes: Array  # (K, 3)
    closed: bool

    def evaluate(self, t: ArrayLike) -> Array:
        """Positions (N, 3) at parameters t (N,) in [0, knots[-1]]."""
        t = np.asarray(t, float)
        if len(self.knots) == 1:
            return np.repeat(self.points, len(t), axis=0)
        span = np.clip(np.searchsorted(self.knots, t, "right") - 1, 0, len(self.knots) - 2)  # (N,)
        width = (self.knots[span + 1] - self.knots[span])[:, None]  # (N, 1)
        x = (t - self.knots[span])[:, None] / width  # (N, 1), in [0, 1]
        p0, p1 = self.points[span], self.points[span + 1]  # (N, 3)
        d0, d1 = self.slopes[span] * width, self.slopes[span + 1] * width  # (N, 3)
        return (
            p0 * (1 + 2 * x) * (1 - x) ** 2
            + d0 * x * (1 - x) ** 2
            + p1 * x**2 * (3 - 2 * x)
            - d1 * x**2 * (1 - x)
        )

    def resample(self, count: int) -> tuple[Array, Array]:
        """`count` points (N, 3), equally spaced by arc length, and their parameters t (N,).

        A closed curve ends where it starts; the last point repeats the first.
        """
        length, fine = self._lengths()
        return self._at(np.linspace(0, length[-1], count), length, fine)

    def every(self, step: float) -> Array:
        """Points (N, 3) `step` apart by arc length from the start, and the end.

        A curve that grows keeps its points; the last step is between a half and one and a half.
        """
        length, fine = self._lengths()
        steps = np.arange(max(int(length[-1] / step + 0.5), 1))
        return self._at(np.append(step * steps, length[-1]), length, fine)[0]

    def _lengths(self) -> tuple[Array, Array]:
        """The length of the curve (F,) up to parameters t (F,), close to one another."""
        fine = np.interp(
            np.arange((len(self.knots) - 1) * STEPS_PER_SPAN + 1) / STEPS_PER_SPAN,
            np.arange(len(self.knots)),
            self.knots,
        )
        return arc_length(self.evaluate(fine)), fine

    def _at(self, along: Array, length: Array, fine: Array) -> tuple[Array, Array]:
        """Points (N, 3) at arc lengths (N,), and their parameters (N,)."""
        t = np.interp(along, length, fine)
        return self.evaluate(t), t


def fit_curve(points: ArrayLike, closed: bool = False) -> Curve:
    """The spline through control points (K, 3); points repeated one after another count once.

    A closed curve needs three distinct points; with fewer it is open.
    """
    points = np.asarray(points, float).reshape(-1, 3)
    counted, closed = through(points, closed)
    p = points[counted]
    if closed:
        p = np.vstack([p, p[0]])
    knots = arc_length(p)
    if len(p) == 1:
        slopes = np.zeros_like(p)
    elif closed:
        slopes = _periodic_slopes(knots, p)
    elif len(p) <= 3:
        slopes = _polynomial_slopes(knots, p)
    else:
        slopes = _not_a_knot_slopes(knots, p)
    return Curve(knots, p, slopes, closed)


def through(points: Array, closed: bool) -> tuple[NDArray[np.intp], bool]:
    """Which of the control points (K, 3) count in the spline through them, and whether it is
    closed."""
    moves = np.linalg.norm(np.diff(points, axis=0), axis=1) > REPEATED  # (K - 1,)
    counted = np.flatnonzero(np.append(True, moves))
    if closed and len(counted) > 1:
        first, last = points[counted[[0, -1]]]
        if np.linalg.norm(last - first) <= REPEATED:
            counted = counted[:-1]
    return counted, closed and len(counted) >= 3


def arc_length(points: Array) -> Array:
    """Length of the polyline up to each of its points (N, 3) -> (N,)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _polynomial_slopes(t: Array, p: Array) -> Array:
    """Slopes of the line or parabola through two or three points."""
    chords = np.diff(p, axis=0) / np.diff(t)[:, None]  # (K - 1, 3)
    if len(p) == 2:
        return np.repeat(chords, 2, axis=0)
    bend = (chords[1] - chords[0]) / (t[2] - t[0])
    return chords[0] + bend * (2 * t[:, None] - t[0] - t[1])


def _not_a_knot_slopes(t: Array, p: Array) -> Array:
    """Third derivative continuous across the second and the last but one knot."""
    bands, right = _equal_curvature(np.diff(t), np.diff(p, axis=0))
    ends, values = np.zeros((3, 2)), np.zeros((2, 3))
    for end, (a, b, c) in enumerate([(0, 1, 2), (-1, -2, -3)]):
        h, next_h = abs(t[b] - t[a]), abs(t[c] - t[b])
        chord, next_chord = (p[b] - p[a]) / (t[b] - t[a]), (p[c] - p[b]) / (t[c] - t[b])
        ends[:, end] = h + next_h, next_h, h + next_h
        values[end] = ((h + 2 * (h + next_h)) * next_h * chord + h**2 * next_chord) / (h + next_h)
    bands = np.hstack([ends[:, :1], bands, ends[:, 1:]])  # (3, K)
    return _solve(bands, np.vstack([values[:1], right, values[1:]]))


def _periodic_slopes(t: Array, p: Array) -> Array:
    """Slope and curvature continuous where the curve closes.

    The corners of the matrix are taken out of it as u v^T (Sherman and Morrison 1950).
    """
    h, moves = np.diff(t), np.diff(p, axis=0)
    h, moves = np.append(h[-1], h), np.vstack([moves[-1], moves])
    (below, diagonal, above), right = _equal_curvature(h, moves)
    last, first = below[0], above[-1]  # of the matrix, at the ends of its first and last row
    share = last / diagonal[0]  # u = (-diagonal[0], 0, ..., first), v = (1, 0, ..., -share)
    u = np.zeros((len(right), 1))
    u[[0, -1], 0] = -diagonal[0], first
    diagonal[0] *= 2
    diagonal[-1] += first * share
    x = _solve(np.stack([below, diagonal, above]), np.hstack([right, u]))  # (K - 1, 4)
    x, z = x[:, :3], x[:, 3:]
    x -= z * (x[0] - share * x[-1]) / (1 + z[0] - share * z[-1])
    return np.vstack([x, x[0]])


def _equal_curvature(h: Array, moves: Array) -> tuple[Array, Array]:
    """The equations of equal curvature where spans of width h (N,) and chords `moves` (N, 3) meet.

    Three bands (3, N - 1), the factors of the slopes before, at and after; right sides (N - 1, 3).
    """
    chords = moves / h[:, None]
    right = 3 * (h[1:, None] * chords[:-1] + h[:-1, None] * chords[1:])
    return np.stack([h[1:], 2 * (h[:-1] + h[1:]), h[:-1]]), right


def _solve(bands: Array, right: Array) -> Array:
    """x (K, C) of a tridiagonal matrix, its `bands` (3, K) below, on and above the diagonal.

    By elimination, in time linear in K: NumPy's own solver takes 20 ms for 500 points.
    """
    below, diagonal, above = bands.tolist()
    factor = [0.0] * len(below)
    for i in range(1, len(below)):
        factor[i] = below[i] / diagonal[i - 1]
        diagonal[i] -= factor[i] * above[i - 1]
    columns = right.T.tolist()
    for x in columns:
        for i in range(1, len(x)):
            x[i] -= factor[i] * x[i - 1]
        x[-1] /= diagonal[-1]
        for i in range(len(x) - 2, -1, -1):
            x[i] = (x[i] - above[i] * x[i + 1]) / diagonal[i]
    return np.array(columns).T
