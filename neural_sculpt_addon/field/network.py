# SPDX-License-Identifier: GPL-3.0-or-later
"""The network: a SIREN whose zero level set is the shape.

    h_0 = x,  h_k = sin(omega_k (W_k h_{k-1} + b_k)),  f(x) = w . h_L + b

f is negative inside, in model space. Sitzmann et al., "Implicit Neural Representations with
Periodic Activation Functions", 2020; the paper's networks are 3-128-128-1 with omega = 30.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True)
class Siren:
    """A sine network of any depth and width, as plain tensors.

    weights: one (out, in) tensor per layer, the first (., 3), the last (1, .)
    biases:  one (out,) tensor per layer
    omegas:  one frequency factor per hidden layer, dimensionless
    """

    weights: tuple[Tensor, ...]
    biases: tuple[Tensor, ...]
    omegas: tuple[float, ...]

    @staticmethod
    def random(
        widths: Sequence[int] = (128, 128),
        omega: float | Sequence[float] = 30.0,
        generator: torch.Generator | None = None,
    ) -> "Siren":
        """A network with the initialisation of the SIREN paper (section 3.2)."""
        omegas = tuple(omega) if isinstance(omega, Sequence) else (omega,) * len(widths)
        sizes = (3, *widths, 1)
        weights, biases = [], []
        for layer, (fan_in, fan_out) in enumerate(pairwise(sizes)):
            scale = omegas[min(layer, len(omegas) - 1)]
            bound = 1 / fan_in if layer == 0 else (6 / fan_in) ** 0.5 / scale
            uniform = torch.rand(fan_out, fan_in, generator=generator)  # (out, in)
            weights.append((2 * uniform - 1) * bound)
            uniform = torch.rand(fan_out, generator=generator)  # (out,)
            biases.append((2 * uniform - 1) / fan_in**0.5)
        return Siren(tuple(weights), tuple(biases), omegas)

    @property
    def widths(self) -> tuple[int, ...]:
        """Units of each hidden layer."""
        return tuple(len(bias) for bias in self.biases[:-1])

    @property
    def device(self) -> torch.device:
        """Where the tensors live."""
        return self.weights[0].device

    @property
    def parameters(self) -> tuple[Tensor, ...]:
        """All tensors, layer by layer: W_1, b_1, W_2, b_2, ..."""
        pairs = zip(self.weights, self.biases, strict=True)
        return tuple(tensor for pair in pairs for tensor in pair)

    def with_parameters(self, parameters: Sequence[Tensor]) -> "Siren":
        """The same architecture with other tensors, in the order of `parameters`."""
        return Siren(tuple(parameters[0::2]), tuple(parameters[1::2]), self.omegas)

    def to(self, device: torch.device | str) -> "Siren":
        """The same network on another device."""
        return self.with_parameters([tensor.to(device) for tensor in self.parameters])

    def value(self, x: Tensor) -> Tensor:
        """f at points x (N, 3) -> (N,)."""
        h = x
        for weight, bias, omega in zip(self.weights, self.biases, self.omegas, strict=False):
            h = torch.sin(torch.addmm(omega * bias, h, (omega * weight).T))  # (N, width)
        return h @ self.weights[-1][0] + self.biases[-1]  # (N,)

    def value_and_gradient(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """f (N,) and its gradient (N, 3) at points x (N, 3), in closed form.

        One pass forward, one back; differentiable once more by autograd, so a loss on the gradient
        needs no double backward.
        """
        h, slopes = x, []
        for weight, bias, omega in zip(self.weights, self.biases, self.omegas, strict=False):
            z = torch.addmm(omega * bias, h, (omega * weight).T)  # (N, width)
            h, slope = _SineAndCosine.apply(z)
            slopes.append(slope)
        value = h @ self.weights[-1][0] + self.biases[-1]  # (N,)
        back = self.weights[-1]  # (1, width), broadcast over the points
        for weight, omega, slope in zip(
            reversed(self.weights[:-1]), reversed(self.omegas), reversed(slopes), strict=True
        ):
            back = (back * slope) @ (omega * weight)  # (N, width below)
        return value, back


class FoldedSiren:
    """A network with omega folded into its weights, for evaluation without autograd.

    The network is so small that overhead decides: NumPy takes the sines on the CPU, half of the
    work, for which torch needs a sixth longer. The weights lie in memory by columns, because MKL
    multiplies by three columns side by side three times slower.
    """

    def __init__(self, network: Siren) -> None:
        """Fold once, evaluate often."""
        layers = list(zip(network.weights, network.biases, network.omegas, strict=False))
        self._weights = [(omega * weight).T.contiguous().T for weight, _, omega in layers]
        self._biases = [omega * bias for _, bias, omega in layers]
        self._last_weight, self._last_bias = network.weights[-1], network.biases[-1]

    def value(self, x: Tensor) -> Tensor:
        """f at points x (N, 3) -> (N,)."""
        h, _ = self._forward(x, cosines=False)
        return self._output(h)

    def value_and_gradient(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """f (N,) and its gradient (N, 3) at points x (N, 3)."""
        h, cosines = self._forward(x, cosines=True)
        back = self._last_weight  # (1, width), broadcast over the points
        for weight, cosine in zip(reversed(self._weights), reversed(cosines), strict=True):
            back = cosine.mul_(back) @ weight  # (N, width below)
        return self._output(h), back

    def _output(self, h: Tensor) -> Tensor:
        """f (N,) of the last hidden layer (N, width)."""
        return torch.mv(h, self._last_weight[0]) + self._last_bias

    def _forward(self, h: Tensor, cosines: bool) -> tuple[Tensor, list[Tensor]]:
        """The last hidden layer (N, width) and, if wanted, the cosines of every layer."""
        kept = []
        for weight, bias in zip(self._weights, self._biases, strict=True):
            h = torch.addmm(bias, h, weight.T)
            if cosines:
                kept.append(_cosine(h))
            _put_sine(h)
        return h, kept


def _put_sine(h: Tensor) -> None:
    """Put sin(h) in the place of h."""
    if h.device.type == "cpu":
        np.sin(h.numpy(), out=h.numpy())
    else:
        h.sin_()


def _cosine(h: Tensor) -> Tensor:
    return torch.from_numpy(np.cos(h.numpy())) if h.device.type == "cpu" else torch.cos(h)


class _SineAndCosine(torch.autograd.Function):
    """sin z and cos z, each of which is the other's derivative: autograd computes them twice."""

    @staticmethod
    def forward(ctx: Any, z: Tensor) -> tuple[Tensor, Tensor]:
        sine, cosine = torch.sin(z), torch.cos(z)
        ctx.save_for_backward(sine, cosine)
        return sine, cosine

    @staticmethod
    def backward(ctx: Any, *slopes: Tensor) -> Tensor:
        sine, cosine = ctx.saved_tensors
        return torch.addcmul(slopes[0] * cosine, slopes[1], sine, value=-1)
