# SPDX-License-Identifier: GPL-3.0-or-later
"""The unknowns of a Gauss-Newton edit: W, b of the last hidden layer and w, c of the output.

    f(x) = w . sin(omega (W a(x) + b)) + c

Everything below stays as it is, so the features a(x) of a point never change. A bias is one more
column of its matrix, and one more feature that is 1.
"""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from ..network import Siren
from .least_squares import Linear
from .rows import Rows


class Bases(NamedTuple):
    """Orthogonal coordinates in which J^T J is nearly diagonal.

    The eigenvectors of the second moments of the factors of J. The weakest one of the A + 1 on the
    right is left out: products of A columns are faster by a fifth than those of one more.
    """

    left: Tensor  # (H, H)
    right: Tensor  # (A + 1, A)
    output: Tensor  # (H + 1, H + 1)


class _Forward(NamedTuple):
    """What n value rows and m derivative rows need of the network."""

    features: Tensor  # (n + m, A + 1)
    slopes: Tensor  # (m, A + 1), of the features along the directions
    sine: Tensor  # (n + m, H)
    cosine: Tensor  # (n + m, H)
    dz: Tensor  # (m, H), slope of the sine's argument along the directions
    output: Tensor  # (n + m, H + 1), the rows as linear functions of w and c


class Layers:
    """The unknowns at some value."""

    def __init__(
        self, network: Siren, inner: Tensor, output: Tensor, bases: Bases | None = None
    ) -> None:
        """`inner` (H, A + 1) and `output` (H + 1,) take the place of the layers of `network`."""
        self._network = network
        self._inner = inner
        self._output = output
        self._bases = bases
        self._omega = network.omegas[-1]

    @staticmethod
    def of(network: Siren) -> "Layers":
        """The unknowns at the values that they have in `network`."""
        inner = torch.cat([network.weights[-2], network.biases[-2][:, None]], 1)
        return Layers(network, inner, torch.cat([network.weights[-1][0], network.biases[-1]]))

    @staticmethod
    def mean(several: Sequence["Layers"]) -> "Layers":
        """The mean of unknowns at several values."""
        inner = torch.stack([one._inner for one in several]).mean(0)
        output = torch.stack([one._output for one in several]).mean(0)
        return Layers(several[0]._network, inner, output, several[0]._bases)

    def network(self) -> Siren:
        """The whole network with these unknowns."""
        below = self._network.parameters[:-4]
        weight, bias = self._inner[:, :-1].contiguous(), self._inner[:, -1].contiguous()
        last, constant = self._output[None, :-1].contiguous(), self._output[-1:].clone()
        return self._network.with_parameters([*below, weight, bias, last, constant])

    def moved(self, x: Tensor) -> "Layers":
        """The unknowns after a change x (H A + H + 1,) in the coordinates of the bases."""
        assert self._bases is not None, "a change comes from a linearisation"
        left, right, output = self._bases
        matrix = x[: -len(output)].view(len(left), -1)
        inner = self._inner + left @ matrix @ right.T
        return Layers(self._network, inner, self._output + output @ x[-len(output) :], self._bases)

    def residual(self, rows: Rows) -> Tensor:
        """r for `rows` (n + m,)."""
        return rows.weights * (rows.targets - self._forward(rows).output @ self._output)

    def in_bases(self, rows: Rows) -> "Layers":
        """The same unknowns, in coordinates that are chosen for rows like these."""
        left, right, output, _ = self._factors(rows)
        bases = Bases(_eigenvectors(left), _eigenvectors(right)[:, 1:], _eigenvectors(output))
        return Layers(self._network, self._inner, self._output, bases)

    def linearise(self, rows: Rows) -> Linear:
        """J and r for `rows`, in the coordinates of the bases."""
        assert self._bases is not None, "choose coordinates first"
        left, right, output, residual = self._factors(rows)
        bases = self._bases
        return Linear(left @ bases.left, right @ bases.right, output @ bases.output, residual)

    def _factors(self, rows: Rows) -> Linear:
        """J and r for `rows`, in the coordinates of the network."""
        n = rows.values
        now = self._forward(rows)
        residual = rows.weights * (rows.targets - now.output @ self._output)
        g = self._omega * self._output[:-1] * rows.weights[:, None]  # (n + m, H)
        values, slopes = g[:n] * now.cosine[:n], g[n:] * now.cosine[n:]
        left = torch.cat([values, -g[n:] * now.sine[n:] * now.dz, slopes])  # (n + 2 m, H)
        right = torch.cat([now.features, now.slopes])  # (n + 2 m, A + 1)
        return Linear(left, right, now.output * rows.weights[:, None], residual)

    def _forward(self, rows: Rows) -> _Forward:
        network, n = self._network, rows.values
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


def _eigenvectors(rows: Tensor) -> Tensor:
    """Eigenvectors (K, K) of the second moment of rows (N, K), the weakest first."""
    return torch.linalg.eigh(rows.T @ rows / len(rows))[1]
