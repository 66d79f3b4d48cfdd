# SPDX-License-Identifier: GPL-3.0-or-later
"""Adam (Kingma and Ba, 2015), in place on a handful of tensors.

torch.optim.Adam computes the same, but its first use imports torch's compiler: 800 modules and over
a second, which an artist would wait for at the first stroke.
"""

from collections.abc import Sequence

import torch
from torch import Tensor


class Adam:
    """Adam's state for `parameters`, which `step` changes in place."""

    def __init__(
        self,
        parameters: Sequence[Tensor],
        betas: tuple[float, float] = (0.9, 0.999),
        epsilon: float = 1e-8,
    ) -> None:
        self.parameters, self.betas, self.epsilon = parameters, betas, epsilon
        self.means = [torch.zeros_like(parameter) for parameter in parameters]
        self.squares = [torch.zeros_like(parameter) for parameter in parameters]
        self.steps = 0

    @torch.no_grad()
    def step(self, gradients: Sequence[Tensor], rate: float) -> None:
        """One step of learning rate `rate` down the `gradients`, one for each parameter."""
        self.steps += 1
        first, second = self.betas
        rate /= 1 - first**self.steps
        root = (1 - second**self.steps) ** 0.5
        state = zip(self.parameters, gradients, self.means, self.squares, strict=True)
        for parameter, gradient, mean, square in state:
            mean.lerp_(gradient, 1 - first)
            square.mul_(second).addcmul_(gradient, gradient, value=1 - second)
            spread = square.sqrt().div_(root).add_(self.epsilon)
            parameter.addcdiv_(mean, spread, value=-rate)
