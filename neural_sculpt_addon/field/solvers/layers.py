# SPDX-License-Identifier: GPL-3.0-or-later
"""The unknowns of a Gauss-Newton edit: W, b of the last hidden layer and w, c of the output.

    f(x) = w . sin(omega (W a(x) + b)) + c

Everything below stays as it is, so the features a(x) of a point never change. A bias is one more
column of its matrix, and one more feature that is 1. Features of neighbouring points are much
alike: W changes only in the K directions in which they differ most.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from ..network import Siren
from .least_squares import Linear, eigenvectors
from .rows import Rows


class View(NamedTuple):
    """What n value rows and m derivative rows see of the network."""

    features: Tensor  # (n + m, K), in the directions in which W changes
    slopes: Tensor  # (m, K), of the features along the rows' directions
    z: Tensor  # (n + m, H), the arguments of the sine
    dz: Tensor  # (m, H), their slopes along the directions


class Layers:
    """The unknowns at some value."""

    def __init__(self, network: Siren, inner: Tensor, output: Tensor, right: Tensor) -> None:
        """`inner` (H, A + 1) and `output` (H + 1,) take the place of the layers of `network`;
        `right` (A + 1, K), orthogonal, are the directions of features in which `inner` changes."""
        self._network = network
        self._inner = inner
        self._output = output
        self._right = right
        self._omega = network.omegas[-1]

    @staticmethod
    def of(network: Siren, rows: Rows, rank: float) -> "Layers":
        """The unknowns at the values that they have in `network`.

        The K directions, `rank` for each of A, are those in which the features of `rows` differ
        most.
        """
        inner = torch.cat([network.weights[-2], network.biases[-2][:, None]], 1)
        output = torch.cat([network.weights[-1][0], network.biases[-1]])
        every = torch.eye(inner.shape[1]).to(inner)
        view = Layers(network, inner, output, every).view(rows)
        weights = rows.weights[:, None]
        seen = torch.cat([weights * view.features, weights[rows.values :] * view.slopes])
        count = math.ceil(rank * (inner.shape[1] - 1))
        return Layers(network, inner, output, eigenvectors(seen)[:, -count:].contiguous())

    @staticmethod
    def mean(several: Sequence["Layers"]) -> "Layers":
        """The mean of unknowns at several values."""
        inner = torch.stack([one._inner for one in several]).mean(0)
        output = torch.stack([one._output for one in several]).mean(0)
        return Layers(several[0]._network, inner, output, several[0]._right)

    def network(self) -> Siren:
        """The whole network with these unknowns."""
        below = self._network.parameters[:-4]
        weight, bias = self._inner[:, :-1].contiguous(), self._inner[:, -1].contiguous()
        last, constant = self._output[None, :-1].contiguous(), self._output[-1:].clone()
        return self._network.with_parameters([*below, weight, bias, last, constant])

    def moved(self, x: Tensor) -> "Layers":
        """The unknowns after a change x (H K + H + 1,)."""
        matrix, vector = self._split(x)
        inner = self._inner + matrix @ self._right.T
        return Layers(self._network, inner, self._output + vector, self._right)

    def view(self, rows: Rows) -> View:
        """What `rows` see."""
        network, n = self._network, rows.values
        h, dh = rows.points, rows.directions
        below = network.weights[:-2], network.biases[:-2], network.omegas[:-1]
        for weight, bias, omega in zip(*below, strict=True):
            z = torch.addmm(omega * bias, h, (omega * weight).T)
            dh = torch.cos(z[n:]) * (dh @ (omega * weight).T)
            h = z.sin_()
        weight, bias = self._omega * self._inner[:, :-1], self._omega * self._inner[:, -1]
        features = torch.addmm(self._right[-1], h, self._right[:-1])
        return View(features, dh @ self._right[:-1], torch.addmm(bias, h, weight.T), dh @ weight.T)

    def view_after(self, x: Tensor, view: View) -> View:
        """What rows of a `view` see after a change x (H K + H + 1,)."""
        turn = self._omega * self._split(x)[0].T  # (K, H)
        z, dz = torch.addmm(view.z, view.features, turn), torch.addmm(view.dz, view.slopes, turn)
        return view._replace(z=z, dz=dz)

    def residual(self, rows: Rows, view: View) -> Tensor:
        """r for `rows` (n + m,)."""
        n, weight = rows.values, self._output[:-1]
        value = torch.addmv(self._output[-1:], torch.sin(view.z[:n]), weight)
        slope = (torch.cos(view.z[n:]) * view.dz) @ weight
        return rows.weights * (rows.targets - torch.cat([value, slope]))

    def linearise(self, rows: Rows, view: View) -> Linear:
        """J and r for `rows`."""
        n, weights = rows.values, rows.weights[:, None]
        sine, cosine = torch.sin(view.z), torch.cos(view.z)
        weight = self._omega * self._output[:-1]
        turned = -sine[n:] * view.dz  # (m, H)
        left = torch.cat([cosine * weights, turned * weights[n:]]).mul_(weight)  # (n + 2 m, H)
        features = view.features
        right = torch.cat([features[:n], view.slopes, features[n:]])  # (n + 2 m, K)
        values = torch.cat([sine[:n], torch.ones_like(sine[:n, :1])], 1)
        along = cosine[n:] * view.dz
        output = torch.cat([values, torch.cat([along, torch.zeros_like(along[:, :1])], 1)])
        residual = rows.weights * (rows.targets - output @ self._output)
        return Linear(left, right, output.mul_(weights), residual)

    def _split(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """The change of the matrix (H, K), and that of the vector (H + 1,)."""
        matrix, vector = x.split([len(x) - len(self._output), len(self._output)])
        return matrix.view(len(self._inner), -1), vector
