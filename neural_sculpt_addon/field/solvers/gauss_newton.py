# SPDX-License-Identifier: GPL-3.0-or-later
"""Gauss-Newton on the last hidden layer and the output: an edit in a fraction of a second.

Below its last hidden layer the network stays as it is, so the features a(x) that enter that layer
are fixed and the unknowns are W, b and w, c of

    f(x) = w . sin(omega (W a(x) + b)) + c

A step draws fresh samples and minimises |J delta - r|^2 + lambda |D^1/2 delta|^2 by conjugate
gradients on the normal equations. J is never formed: a row of its W block is an outer product
g (x) a, so a product with J or its transpose is a product of (N, width) matrices. Coordinates are
rotated into the eigenvectors of E[a a^T], E[g g^T] and E[s s^T], where the diagonal D is a good
preconditioner (EKFAC: George et al., "Fast Approximate Natural Gradient Descent in a Kronecker
factored Eigenbasis", 2018).

Two kinds of rows ask for the displaced surface:
    value       f(p) = t                 p on or off the surface, t its signed distance
    derivative  grad f(p) . e = n . e    e a random direction; asks for slope one along n and for
                                         the normal, at the scale of a point: a target some way off
                                         the surface would contradict the next ridge
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import torch
from torch import Tensor

from ...stroke.progress import Progress, silent
from ..network import Siren
from ..pieces import find_islands
from ..prepare import CELLS
from ..problem import Problem
from ..proxy import extract
from .rows import Counts, Rows, Sampler

RIDGE = 1e-3  # added to D, in means of each block
DAMPING = 1.0  # lambda of the first step
LEAST, MOST = 0.03, 30.0  # lambda
REPAIR_STEPS = 3
POOR, GOOD = 0.25, 0.75  # part of the promised decrease that a step kept: raise or lower lambda


@dataclass(frozen=True)
class Setting:
    """How much work is done.

    steps, iterations: Gauss-Newton steps, and conjugate gradient iterations in each
    counts:  rows in each step
    repairs: how often at most islands are looked for and removed
    """

    steps: int
    iterations: int
    counts: Counts
    repairs: int = 0


QUICK = Setting(5, 12, Counts(tube=1000, slope=700, preserve=2500, around=300, box=300))
FINAL = Setting(8, 20, Counts(tube=1800, slope=1500, preserve=5000, around=600, box=500), repairs=3)


def solve(problem: Problem, progress: Progress = silent, setting: Setting = FINAL) -> Siren:
    """The network that solves `problem` as well as `setting` allows."""
    sampler = Sampler(problem, setting.counts)
    total = setting.steps + setting.repairs * REPAIR_STEPS

    def share(done: float) -> None:
        progress(done / total, "Sculpting")

    layers, damping = _improve(_Layers.of(problem.network), sampler, setting, DAMPING, share)
    for repair in range(setting.repairs):
        done = setting.steps + repair * REPAIR_STEPS
        proxy = extract(layers.network(), CELLS, lambda _, __, done=done: share(done))
        islands = find_islands(proxy, sampler.asked)
        if not len(islands.points):
            break
        sampler.forbid(islands)
        again = replace(setting, steps=REPAIR_STEPS)
        layers, damping = _improve(
            layers, sampler, again, damping, lambda part, done=done: share(done + part)
        )
    return layers.network()


def _improve(
    layers: "_Layers",
    sampler: Sampler,
    setting: Setting,
    damping: float,
    share: Callable[[float], None],
) -> tuple["_Layers", float]:
    """Gauss-Newton steps with Levenberg and Marquardt's rule for the damping, which goes on."""
    for step in range(setting.steps):
        rows = sampler.draw()
        linear = layers.linearise(rows)
        delta, promised = _solve_step(
            linear, damping, setting.iterations, lambda part, done=step: share(done + part)
        )
        tried = layers.moved(delta)
        decrease = linear.residual.square().sum() - tried.residual(rows).square().sum()
        kept = float(decrease) / promised
        if kept > 0:
            layers = tried
        damping *= 4.0 if kept < POOR else 0.5 if kept > GOOD else 1.0
        damping = min(max(damping, LEAST), MOST)
    return layers, damping


class Linear(NamedTuple):
    """J and r at the present weights, in rotated coordinates; rows carry their weights.

    A derivative row is a sum of two outer products: its second one stands in the last m places of
    `left` and `right`.
    """

    left: Tensor  # (n + 2 m, H), factors g
    right: Tensor  # (n + 2 m, A + 1), factors a
    output: Tensor  # (n + m, H + 1), the rows' part in w and c
    residual: Tensor  # (n + m,)


class Delta(NamedTuple):
    """A change of the unknowns, in rotated coordinates."""

    inner: Tensor  # (H, A + 1), of W and b
    output: Tensor  # (H + 1,), of w and c


class Bases(NamedTuple):
    """Orthogonal coordinates of the factors of J, from the first rows that are seen."""

    left: Tensor  # (H, H)
    right: Tensor  # (A + 1, A + 1)
    output: Tensor  # (H + 1, H + 1)


class _Forward(NamedTuple):
    """What rows need of the network."""

    features: Tensor  # (n + m, A + 1), a(x) and a one for the bias
    slopes: Tensor  # (m, A + 1), of the features along the directions
    sine: Tensor  # (n + m, H)
    cosine: Tensor  # (n + m, H)
    dz: Tensor  # (m, H), slope of the sine's argument along the directions
    output: Tensor  # (n + m, H + 1), the rows as linear functions of w and c


class _Layers:
    """The unknowns: the last hidden layer and the output, each with its bias as a last column."""

    def __init__(
        self, network: Siren, inner: Tensor, output: Tensor, bases: Bases | None = None
    ) -> None:
        self._network = network
        self._inner = inner  # (H, A + 1)
        self._output = output  # (H + 1,)
        self._bases = bases
        self._omega = network.omegas[-1]

    @staticmethod
    def of(network: Siren) -> "_Layers":
        """The unknowns at the values that they have in `network`."""
        inner = torch.cat([network.weights[-2], network.biases[-2][:, None]], 1)
        return _Layers(network, inner, torch.cat([network.weights[-1][0], network.biases[-1]]))

    def network(self) -> Siren:
        """The whole network with the present unknowns."""
        below = self._network.parameters[:-4]
        weight, bias = self._inner[:, :-1].contiguous(), self._inner[:, -1].contiguous()
        last, constant = self._output[None, :-1].contiguous(), self._output[-1:].clone()
        return self._network.with_parameters([*below, weight, bias, last, constant])

    def moved(self, delta: Delta) -> "_Layers":
        """The unknowns after a change in rotated coordinates."""
        assert self._bases is not None, "a change comes from a linearisation"
        left, right, output = self._bases
        inner = self._inner + left @ delta.inner @ right.T
        return _Layers(self._network, inner, self._output + output @ delta.output, self._bases)

    def residual(self, rows: Rows) -> Tensor:
        """r for `rows` at the present unknowns (n + m,)."""
        return rows.weights * (rows.targets - self._forward(rows).output @ self._output)

    def linearise(self, rows: Rows) -> Linear:
        """J and r for `rows` at the present unknowns."""
        n = len(rows.points) - len(rows.directions)
        now = self._forward(rows)
        residual = rows.weights * (rows.targets - now.output @ self._output)
        g = self._omega * self._output[:-1] * rows.weights[:, None]  # (n + m, H)
        values, slopes = g[:n] * now.cosine[:n], g[n:] * now.cosine[n:]
        left = torch.cat([values, -g[n:] * now.sine[n:] * now.dz, slopes])  # (n + 2 m, H)
        right = torch.cat([now.features, now.slopes])  # (n + 2 m, A + 1)
        output = now.output * rows.weights[:, None]  # (n + m, H + 1)
        if self._bases is None:
            self._bases = Bases(_eigenvectors(left), _eigenvectors(right), _eigenvectors(output))
        bases = self._bases
        return Linear(left @ bases.left, right @ bases.right, output @ bases.output, residual)

    def _forward(self, rows: Rows) -> _Forward:
        network, n = self._network, len(rows.points) - len(rows.directions)
        h, dh = rows.points, rows.directions
        below = network.weights[:-2], network.biases[:-2], network.omegas[:-1]
        for weight, bias, omega in zip(*below, strict=True):
            z = omega * (h @ weight.T + bias)
            h, dh = torch.sin(z), torch.cos(z[n:]) * (omega * (dh @ weight.T))
        features = torch.cat([h, torch.ones_like(h[:, :1])], 1)
        slopes = torch.cat([dh, torch.zeros_like(dh[:, :1])], 1)
        z = self._omega * (features @ self._inner.T)
        sine, cosine = torch.sin(z), torch.cos(z)
        dz = self._omega * (slopes @ self._inner.T)
        values = torch.cat([sine[:n], torch.ones_like(sine[:n, :1])], 1)
        along = cosine[n:] * dz
        output = torch.cat([values, torch.cat([along, torch.zeros_like(along[:, :1])], 1)])
        return _Forward(features, slopes, sine, cosine, dz, output)


def _solve_step(
    linear: Linear, damping: float, iterations: int, share: Callable[[float], None]
) -> tuple[Delta, float]:
    """Damped least squares by preconditioned conjugate gradients, from zero."""
    left, right, output, residual = linear
    m = len(left) - len(residual)
    n = len(residual) - m

    def spread(values: Tensor) -> Tensor:  # (n + m,) -> (n + 2 m,)
        return torch.cat([values, values[n:]])

    def transposed(values: Tensor) -> Delta:
        return Delta((left * spread(values)[:, None]).T @ right, output.T @ values)

    squares = (left**2).T @ (right**2)  # (H, A + 1)
    if m:
        squares += 2 * (left[n : n + m] * left[-m:]).T @ (right[n : n + m] * right[-m:])
    squares_out = (output**2).sum(0)  # (H + 1,)
    scale = torch.rsqrt(squares.clamp_min(0) + RIDGE * squares.mean())
    scale_out = torch.rsqrt(squares_out + RIDGE * squares_out.mean())

    gradient = transposed(residual)
    s, s_out = gradient.inner * scale, gradient.output * scale_out
    y, y_out = torch.zeros_like(s), torch.zeros_like(s_out)
    p, p_out = s.clone(), s_out.clone()
    rho = (s * s).sum() + (s_out * s_out).sum()
    for iteration in range(iterations):
        share(iteration / iterations)
        q = ((right @ (p * scale).T) * left).sum(1)  # (n + 2 m,)
        q = torch.cat([q[:n], q[n : n + m] + q[n + m :]]) + output @ (p_out * scale_out)
        product = transposed(q)
        q_in = product.inner * scale + damping * p
        q_out = product.output * scale_out + damping * p_out
        alpha = rho / ((p * q_in).sum() + (p_out * q_out).sum())
        y, y_out = y + alpha * p, y_out + alpha * p_out
        s, s_out = s - alpha * q_in, s_out - alpha * q_out
        old, rho = rho, (s * s).sum() + (s_out * s_out).sum()
        p, p_out = s + (rho / old) * p, s_out + (rho / old) * p_out
    # |r|^2 - |J delta - r|^2, of a solution of the damped normal equations
    promised = (y * gradient.inner * scale).sum() + (y_out * gradient.output * scale_out).sum()
    promised += damping * ((y * y).sum() + (y_out * y_out).sum())
    return Delta(y * scale, y_out * scale_out), float(promised)


def _eigenvectors(rows: Tensor) -> Tensor:
    """Eigenvectors of the second moment of rows (N, K): an orthogonal (K, K) matrix."""
    return torch.linalg.eigh(rows.T @ rows / len(rows))[1]
