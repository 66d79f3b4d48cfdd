# SPDX-License-Identifier: GPL-3.0-or-later
"""Adam against torch's own."""

import pytest
import torch

from neural_sculpt_addon.field.solve.adam import Adam


@pytest.mark.parametrize("words", [{}, {"betas": (0.8, 0.95), "epsilon": 1e-3}])
def test_steps_are_those_of_torch(words):
    random = torch.Generator().manual_seed(3)
    start = [torch.randn(shape, generator=random, dtype=torch.float64) for shape in ((4, 3), (5,))]
    mine, theirs = ([tensor.clone() for tensor in start] for _ in range(2))
    adam = Adam(mine, **words)
    other = torch.optim.Adam(
        theirs, lr=1.0, betas=adam.betas, eps=adam.epsilon, foreach=False, fused=False
    )
    for number in range(12):
        rate = 0.1 / (number + 1)
        gradients = [torch.randn(t.shape, generator=random, dtype=t.dtype) for t in start]
        adam.step(gradients, rate)
        for tensor, gradient in zip(theirs, gradients, strict=True):
            tensor.grad = gradient
        other.param_groups[0]["lr"] = rate
        other.step()
        for one, two in zip(mine, theirs, strict=True):
            torch.testing.assert_close(one, two, rtol=1e-12, atol=1e-12)
