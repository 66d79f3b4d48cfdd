# SPDX-License-Identifier: GPL-3.0-or-later
"""The unknowns of a Gauss-Newton edit: W, b of the last hidden layer and w, c of the output.

    f(x) = w . sin(omega (W a(x) + b)) + c

Everything below stays as it is, so the features a(x) of a point never change. A bias is one more
column of its matrix, and one more feature that is 1. Changes are counted in directions in which
J^T J is nearly diagonal (the eigenbases of EKFAC: George et al., "Fast Approximate Natural Gradient
Descent in a Kronecker-factored Eigenbasis", 2018; or the common ones of two sets of rows, which
save a third of the iterations, but as they are not orthogonal, the damping there keeps a first fit
less well on its way). Features of neighbouring points are much alike: W changes only in the K
directions in which they differ most.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from ...stroke.progress import Check, go_on
from ..network import Siren
from .least_squares import Linear, common_directions, eigenvectors
from .precision import product_type
from .rows import Rows

BLOCK = 4096  # rows that are looked at together
MOST = 192  # directions of W's inputs; in a network that has grown more cost more than they bring


class View(NamedTuple):
    """What n value rows and m derivative rows see of the network, and below that, in m places more,
    its slopes along the directions of the derivative rows."""

    features: Tensor  # (n + 2 m, K), in the directions in which W changes; of the type of J
    z: Tensor  # (n + 2 m, H), the arguments of the sine


class Directions(NamedTuple):
    """Unit directions in which the unknowns change."""

    left: Tensor  # (H, H), of the outputs of W
    right: Tensor  # (A + 1, K), of its inputs
    output: Tensor  # (H + 1, O), of the output layer

    @staticmethod
    def of(
        network: Siren,
        rows: Rows,
        rank: float,
        output: int,
        split: bool,
        check: Check = go_on,
    ) -> "Directions":
        """Those in which what `rows` see differs most; of W's inputs `rank` for each of A.

        output: how many at most of the output layer
        split: in the span of those of W, the ones in which J^T J is nearly diagonal when rows near
               the stroke and others see different things. They are not orthogonal
        check: called between the parts of the work, may raise
        """
        units, inputs = network.weights[-2].shape
        sizes = units, inputs + 1, units + 1
        layers = Layers.of(network, Directions(*(torch.eye(n).to(rows.points) for n in sizes)))
        view = layers.view(rows, check)
        check()
        linear = layers.linearise(rows, view)
        check()
        changes = linear.left.to(rows.points)
        seen = torch.cat([rows.weights, rows.weights[rows.values :]])[:, None] * view.features
        check()
        near, far = _moments(changes, rows)
        left = common_directions(near, far) if split else eigenvectors(near + far)
        last = eigenvectors(linear.output.T @ linear.output)[:, -output:]
        check()
        near, far = _moments(seen, rows)
        check()
        right = eigenvectors(near + far)[:, -min(math.ceil(rank * inputs), MOST) :]
        if split:
            check()
            right = right @ common_directions(right.T @ near @ right, right.T @ far @ right)
        check()
        return Directions(left, right.contiguous(), last.contiguous())


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
        self._coarse = product_type(inner)

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
        """The unknowns after a change x (H K + O,)."""
        inner, output = self._change(x)
        inner = self._inner + inner @ self._directions.right.T
        return Layers(self._network, self._directions, inner, self._output + output)

    def view(self, rows: Rows, check: Check = go_on) -> View:
        """What `rows` see. `check` is called between blocks of them, and may raise."""
        network, n, count = self._network, rows.values, len(rows.points)
        below = network.weights[:-2], network.biases[:-2], network.omegas[:-1]
        layers = [
            ((omega * weight).T, omega * bias) for weight, bias, omega in zip(*below, strict=True)
        ]
        right = self._directions.right.to(self._coarse)  # (A + 1, K)
        inner = (self._omega * self._inner).T  # (A + 1, H)
        places = count + len(rows.directions)
        features = right.new_empty(places, right.shape[1])
        z = inner.new_empty(places, inner.shape[1])

        def see(h: Tensor, start: int, beta: float) -> None:
            """Write down what inputs (B, A) of W lead to, or their slopes, which see no bias."""
            block = slice(start, start + len(h))
            torch.addmm(right[-1], h.to(right.dtype), right[:-1], beta=beta, out=features[block])
            torch.addmm(inner[-1], h, inner[:-1], beta=beta, out=z[block])

        for start in (*range(0, n, BLOCK), *range(n, count, BLOCK)):
            check()
            block = slice(start, min(start + BLOCK, n if start < n else count))
            h, dh = rows.points[block], rows.directions[max(start - n, 0) : max(block.stop - n, 0)]
            for weight, bias in layers:
                argument = torch.addmm(bias, h, weight)
                if len(dh):
                    dh = torch.cos(argument) * (dh @ weight)
                h = argument.sin_()
            see(h, start, 1.0)
            if len(dh):
                see(dh, start + len(rows.directions), 0.0)
        return View(features, z)

    def view_after(self, x: Tensor, view: View) -> View:
        """What rows of a `view` see after a change x (H K + O,)."""
        turn = self._omega * self._change(x)[0].T  # (K, H)
        return view._replace(z=view.z + view.features @ turn.to(self._coarse))

    def residual(self, rows: Rows, view: View) -> Tensor:
        """r for `rows` (n + m,)."""
        n, count, weight = rows.values, len(rows.points), self._output[:-1]
        value = torch.addmv(self._output[-1:], torch.sin(view.z[:n]), weight)
        slope = (torch.cos(view.z[n:count]) * view.z[count:]) @ weight
        return rows.weights * (rows.targets - torch.cat([value, slope]))

    def linearise(self, rows: Rows, view: View) -> Linear:
        """J and r for `rows`."""
        n, count, weights = rows.values, len(rows.points), rows.weights[:, None]
        sine, cosine, dz = torch.sin(view.z[:count]), torch.cos(view.z[:count]), view.z[count:]
        left = torch.empty_like(view.z)
        torch.mul(cosine[:n], weights[:n], out=left[:n])
        torch.mul(sine[n:] * dz, -weights[n:], out=left[n:count])
        torch.mul(cosine[n:], weights[n:], out=left[count:])
        output = sine.new_ones(count, len(self._output))
        output[:n, :-1] = sine[:n]
        output[n:, :-1] = cosine[n:] * dz
        output[n:, -1] = 0
        residual = rows.weights * (rows.targets - output @ self._output)
        turned = (self._omega * self._output[:-1, None]) * self._directions.left
        changes = left.to(self._coarse) @ turned.to(self._coarse)
        output = output.mul_(weights).to(self._coarse) @ self._directions.output.to(self._coarse)
        return Linear(changes, view.features, output.to(residual.dtype), residual)

    def _change(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """The change of W in directions of its inputs (H, K), and that of the output (H + 1,)."""
        left, right, output = self._directions
        matrix, vector = x.split([left.shape[1] * right.shape[1], output.shape[1]])
        return left @ matrix.view(left.shape[1], -1), output @ vector


def _moments(seen: Tensor, rows: Rows) -> tuple[Tensor, Tensor]:
    """Second moments (K, K) of what `rows` see (n + 2 m, K): of those near the stroke, of others.

    All derivative rows are near.
    """
    parts = seen.split([rows.near, rows.values - rows.near, len(seen) - rows.values])
    near, far, slopes = (part.T @ part for part in parts)
    return near + slopes, far
