# SPDX-License-Identifier: GPL-3.0-or-later
"""Growing a network without changing its field, for strokes finer than it can hold.

New units of the first layer get random directions and higher frequencies than the fitted ones; new
units of later layers get random weights. What leaves a new unit starts at zero, so f stays the same
to rounding (Net2Net: Chen et al., "Net2Net: Accelerating Learning via Knowledge Transfer", 2016).
"""

from collections.abc import Sequence

import torch

from ..stroke.errors import SculptError
from .network import Siren


def grow(network: Siren, widths: Sequence[int], frequency: float = 1.2, seed: int = 0) -> Siren:
    """The same field in a network of larger `widths`, one per hidden layer.

    frequency: the largest length of a new row of the first layer, where the authors' fitted rows
               reach 1/3 to 0.6; times omega it is the angular frequency in model space
    SculptError when a layer would shrink.
    """
    if len(widths) != len(network.widths) or any(
        new < old for new, old in zip(widths, network.widths, strict=True)
    ):
        raise SculptError(f"A network of {network.widths} units cannot grow to {tuple(widths)}.")
    generator = torch.Generator().manual_seed(seed)
    weights, biases = [], []
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        fan_out = widths[layer] if layer < len(widths) else 1
        fan_in = 3 if layer == 0 else widths[layer - 1]
        new = fan_out - len(bias)
        if layer == 0:
            rows = torch.randn(new, 3, generator=generator)
            rows *= (
                frequency * torch.rand(new, 1, generator=generator) / rows.norm(dim=1, keepdim=True)
            )
            offsets = (2 * torch.rand(new, generator=generator) - 1) * torch.pi / network.omegas[0]
        else:
            bound = (6 / fan_in) ** 0.5 / network.omegas[min(layer, len(widths) - 1)]
            rows = (2 * torch.rand(new, fan_in, generator=generator) - 1) * bound
            offsets = (2 * torch.rand(new, generator=generator) - 1) * bound
        old = torch.cat([weight, weight.new_zeros(len(bias), fan_in - weight.shape[1])], 1)
        weights.append(torch.cat([old, rows.to(weight)]))
        biases.append(torch.cat([bias, offsets.to(bias)]))
    return Siren(tuple(weights), tuple(biases), network.omegas)
