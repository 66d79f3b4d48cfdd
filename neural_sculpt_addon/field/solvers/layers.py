# SPDX-License-Identifier: GPL-3.0-or-later
"""The unknowns of a Gauss-Newton edit: W, b of the last hidden layer and w, c of the output.

    f(x) = w . sin(omega (W a(x) + b)) + c

Everything below stays as it is, so the features a(x) of a point never change. A bias is one more
column of its matrix, and one more feature that is 1. Changes are counted in directions in which
J^T J is nearly diagonal (the eigenbases of EKFAC: George et al., "Fast Approximate Natural Gradient
Descent in a Kronecker-factored Eigenbasis", 2018). Features of neighbouring points are much alike:
W changes only in the K directions in which they differ most.
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


class Directions(NamedTuple):
    """Orthonormal directions in which the unknowns change."""

    left: Tensor  # (H, H), of the outputs of W
    right: Tensor  # (A + 1, K), of its inputs
    output: Tensor  # (H + 1, H + 1), of the output layer

    @staticmethod
    def of(network: Siren, rows: Rows, rank: float) -> "Directions":
        """Those in which what `rows` see differs most; of W's inputs `rank` for each of A."""
        units, inputs = network.weights[-2].shape
        sizes = units, inputs + 1, units + 1
        layers = Layers.of(network, Directions(*(torch.eye(n).to(rows.points) for n in sizes)))
        view = layers.view(rows)
        linear = layers.linearise(rows, view)
        weights = rows.weights[:, None]
        seen = torch.cat([weights * view.features, weights[rows.values :] * view.slopes])
        right = eigenvectors(seen)[:, -math.ceil(rank * inputs) :].contiguous()
        return Directions(eigenvectors(linear.left), right, eigenvectors(linear.output))


class Layers:
    """The unknowns at some value."""

    def __init__(
        self, network: Siren, directions: Directions, inner: Tensor, output: Tensor
    ) -> None:
        """`inner` (H, A + 1) and `output` (H + 1,) take the place of the layers of `network`."""
        self._network = network
        self._directions = directions
        self._inner = inner
        self._output = output
        self._omega = network.omegas[-1]

    @staticmethod
    def of(network: Siren, directions: Directions) -> "Layers":
        """The unknowns at the values that they have in `network`."""
        inner = torch.cat([network.weights[-2], network.biases[-2][:, None]], 1)
        output = torch.cat([network.weights[-1][0], network.biases[-1]])
        return Layers(network, directions, inner, output)

    @staticmethod
    def mean(several: Sequence["Layers"]) -> "Layers":
        """The mean of unknowns at several values."""
        inner = torch.stack([one._inner for one in several]).mean(0)
        output = torch.stack([one._output for one in several]).mean(0)
        return Layers(several[0]._network, several[0]._directions, inner, output)

    def network(self) -> Siren:
        """The whole network with these unknowns."""
        below = self._network.parameters[:-4]
        weight, bias = self._inner[:, :-1].contiguous(), self._inner[:, -1].contiguous()
        last, constant = self._output[None, :-1].contiguous(), self._output[-1:].clone()
        return self._network.with_parameters([*below, weight, bias, last, constant])

    def moved(self, x: Tensor) -> "Layers":
        """The unknowns after a change x (H K + H + 1,)."""
        inner, output = self._change(x)
        inner = self._inner + inner @ self._directions.right.T
        return Layers(self._network, self._directions, inner, self._output + output)

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
        right = self._directions.right
        features = torch.addmm(right[-1], h, right[:-1])
        return View(features, dh @ right[:-1], torch.addmm(bias, h, weight.T), dh @ weight.T)

    def view_after(self, x: Tensor, view: View) -> View:
        """What rows of a `view` see after a change x (H K + H + 1,)."""
        turn = self._omega * self._change(x)[0].T  # (K, H)
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
        output = output.mul_(weights) @ self._directions.output
        return Linear(left @ self._directions.left, right, output, residual)

    def _change(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """The change of W in directions of its inputs (H, K), and that of the output (H + 1,)."""
        left, right, output = self._directions
        matrix, vector = x.split([left.shape[1] * right.shape[1], output.shape[1]])
        return left @ matrix.view(left.shape[1], -1), output @ vector
