# SPDX-License-Identifier: GPL-3.0-or-later
"""Unknowns of a Gauss-Newton edit: W, b of the last hidden layer, w, c of the output.

    f(x) = w . sin(omega (W a(x) + b)) + c

The layers below stay as they are, so the activations a(x) of a point never change. A bias is one
more column of its matrix, and one more activation that is 1. Changes are expressed in directions in
which J^T J is nearly diagonal: the eigenbases of EKFAC (George et al., "Fast Approximate Natural
Gradient Descent in a Kronecker-factored Eigenbasis", 2018). Activations of neighbouring points are
much alike: W changes only in the K directions in which they differ most. See docs/method.md,
section 10.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import torch
from torch import Tensor

from ..network import Siren
from ..threads import parallel
from .least_squares import Linear
from .residuals import Residuals

INPUTS = 80  # directions of W's inputs; more are slower


class Activations(NamedTuple):
    """Residuals, and the inputs of W at their points. Where the residuals are of derivatives, N
    more rows have the slopes of the inputs along the directions."""

    residuals: Residuals  # N
    inputs: Tensor  # (N or 2 N, A + 1)

    @staticmethod
    def of(network: Siren, residuals: Residuals) -> "Activations":
        """By the layers below the last hidden one."""
        h, dh = residuals.points, residuals.directions
        below = network.weights[:-2], network.biases[:-2], network.omegas[:-1]
        for weight, bias, omega in zip(*below, strict=True):
            z = torch.addmm(omega * bias, h, omega * weight.T)
            if dh is not None:
                dh = torch.cos(z) * (dh @ (omega * weight.T))
            h = torch.sin(z)
        inputs = torch.cat([h, h.new_ones(len(h), 1)], 1)
        if dh is not None:
            inputs = torch.cat([inputs, torch.cat([dh, dh.new_zeros(len(dh), 1)], 1)])
        return Activations(residuals, inputs)


class Directions(NamedTuple):
    """Orthonormal directions in which the unknowns change."""

    left: Tensor  # (H, H), of the outputs of W
    right: Tensor  # (A + 1, K), of its inputs
    output: Tensor  # (H + 1, O), of the output layer; O = H + 1


@dataclass(frozen=True)
class Layers:
    """The unknowns at some value: `inner` is W with b, `output` w with c."""

    network: Siren
    inner: Tensor  # (H, A + 1)
    output: Tensor  # (H + 1,)

    @staticmethod
    def of(network: Siren) -> "Layers":
        """The unknowns at the values that they have in `network`."""
        inner = torch.cat([network.weights[-2], network.biases[-2][:, None]], 1)
        return Layers(network, inner, torch.cat([network.weights[-1][0], network.biases[-1]]))

    def changed(self) -> Siren:
        """The network with these unknowns."""
        weight, bias = self.inner[:, :-1].contiguous(), self.inner[:, -1].contiguous()
        last, constant = self.output[None, :-1].contiguous(), self.output[-1:].clone()
        below = self.network.parameters[:-4]
        return self.network.with_parameters([*below, weight, bias, last, constant])

    def moved(self, x: Tensor, directions: Directions) -> "Layers":
        """The unknowns after a change x (H K + O,) along `directions`."""
        left, right, output = directions
        matrix, vector = x.split([left.shape[1] * right.shape[1], output.shape[1]])
        inner = left @ matrix.view(left.shape[1], -1) @ right.T
        return replace(self, inner=self.inner + inner, output=self.output + output @ vector)

    def residual(self, at: Activations) -> Tensor:
        """r (N,)."""
        z, count = self._arguments(at), len(at.residuals.points)
        if at.residuals.directions is None:
            f = torch.sin(z) @ self.output[:-1] + self.output[-1]
        else:
            f = (torch.cos(z[:count]) * z[count:]) @ self.output[:-1]
        return at.residuals.weights * (at.residuals.targets - f)

    def linearise(self, at: Activations, directions: Directions) -> Linear:
        """J along `directions`, and r."""
        slopes, output, residual = self._derivatives(at)
        left, right, outer = directions
        return Linear(slopes @ left, at.inputs @ right, output @ outer, residual)

    def directions(self, parts: Sequence[Activations]) -> Directions:
        """Those along which J^T J of all `parts` is nearly diagonal, the strongest ones."""

        def moments(at: Activations) -> tuple[Tensor, ...]:
            slopes, output, _ = self._derivatives(at)
            weights = at.residuals.weights.repeat(len(slopes) // len(output))
            inputs = weights[:, None] * at.inputs
            return slopes.T @ slopes, inputs.T @ inputs, output.T @ output

        sums = [torch.stack(some).sum(0) for some in zip(*parallel(moments, parts), strict=True)]
        left, right, output = (torch.linalg.eigh(some).eigenvectors for some in sums)
        return Directions(left, right[:, -INPUTS:].contiguous(), output)

    def _arguments(self, at: Activations) -> Tensor:
        """Of the sine, and their slopes (N or 2 N, H)."""
        return at.inputs @ (self.network.omegas[-1] * self.inner.T)

    def _derivatives(self, at: Activations) -> tuple[Tensor, Tensor, Tensor]:
        """Of the weighted f by the arguments' sources (N or 2 N, H): W times inputs and slopes; by
        the output layer (N, H + 1); and r (N,)."""
        z, weights = self._arguments(at), at.residuals.weights[:, None]
        count = len(weights)
        sine, cosine, dz = torch.sin(z[:count]), torch.cos(z[:count]), z[count:]
        scale = self.network.omegas[-1] * self.output[:-1]
        if at.residuals.directions is None:
            slopes = weights * cosine * scale
            output = torch.cat([sine, sine.new_ones(count, 1)], 1)
        else:
            slopes = torch.cat([weights * -sine * dz * scale, weights * cosine * scale])
            output = torch.cat([cosine * dz, sine.new_zeros(count, 1)], 1)
        residual = at.residuals.weights * (at.residuals.targets - output @ self.output)
        return slopes, weights * output, residual
