# SPDX-License-Identifier: GPL-3.0-or-later
"""Damped linear least squares, the Jacobian never formed (docs/method.md, section 10).

    minimise |J x - r|^2 + lambda |y|^2,  x = s y

The unknowns x are a matrix (H, K) and then a vector (O,), row after row. A row of J's first block
is an outer product left (x) right, or the sum of two, so products with J and its transpose are
products of matrices (N, width). J comes in parts, whose products threads compute side by side. The
scale s of each unknown makes the diagonal of J^T J nearly 1. The directions of the last system that
was solved precondition the next one, which differs little (Morales and Nocedal, "Automatic
Preconditioning by Limited Memory Quasi-Newton Updating", 2000).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from ...common.progress import Check, go_on
from ..threads import parallel

RIDGE = 0.002  # added to the diagonal of J^T J, in means of each block


class Linear(NamedTuple):
    """N rows of J and r. Where a row is the sum of two outer products, `left` and `right` have 2 N
    rows: first those of all first products, then those of the second ones."""

    left: Tensor  # (N or 2 N, H)
    right: Tensor  # (N or 2 N, K)
    output: Tensor  # (N, O)
    residual: Tensor  # (N,)

    @property
    def sizes(self) -> list[int]:
        """H K and O, the unknowns of both blocks."""
        return [self.left.shape[1] * self.right.shape[1], self.output.shape[1]]

    def apply(self, x: Tensor) -> Tensor:
        """J x (N,), for x (H K + O,)."""
        matrix, vector = x.split(self.sizes)
        products = self.left @ matrix.view(self.left.shape[1], -1)  # (N or 2 N, K)
        terms = torch.linalg.vecdot(products, self.right)
        return terms.view(-1, len(self.residual)).sum(0) + self.output @ vector

    def transposed(self, rows: Tensor) -> Tensor:
        """J^T rows (H K + O,), for rows (N,)."""
        weights = rows.repeat(len(self.left) // len(rows))[:, None]
        inner = ((self.right * weights).T @ self.left).T  # faster than (H, K) at once
        return torch.cat([inner.ravel(), rows @ self.output])

    def gram(self, x: Tensor) -> Tensor:
        """J^T J x."""
        return self.transposed(self.apply(x))

    def gradient(self) -> Tensor:
        """J^T r."""
        return self.transposed(self.residual)

    def diagonal(self) -> Tensor:
        """The diagonal of J^T J (H K + O,)."""
        left, right = (side.split(len(self.residual)) for side in (self.left, self.right))
        terms = range(len(left))
        inner = sum((left[i] * left[j]).T @ (right[i] * right[j]) for i in terms for j in terms)
        assert isinstance(inner, Tensor)
        return torch.cat([inner.clamp_min(0).ravel(), self.output.square().sum(0)])


class Memory(NamedTuple):
    """Directions s of a system A that was solved, and A s, each divided by (s . A s)^1/2.

    They are conjugate, so that the inverse of A is the sum of all s s^T in their span. Between two
    systems they are kept unscaled.
    """

    directions: Tensor  # (k, H K + O)
    products: Tensor  # (k, H K + O)

    def scaled(self, scale: Tensor) -> "Memory":
        """The same directions in coordinates that are divided by `scale`."""
        return Memory(self.directions / scale, self.products * scale)

    def precondition(self, vector: Tensor) -> Tensor:
        """The BFGS update of the identity by all directions, times a gradient (H K + O,)."""
        s, y = self
        along = s @ vector
        rest = vector - along @ y
        return rest + (along - y @ rest) @ s


class Solution(NamedTuple):
    """An approximate solution."""

    x: Tensor  # (H K + O,)
    predicted: float
    """The predicted reduction |r|^2 - |J x - r|^2."""
    memory: Memory


def solve(
    system: Sequence[Linear],
    damping: float,
    iterations: int,
    memory: Memory | None = None,
    check: Check = go_on,
) -> Solution:
    """The solution after `iterations` preconditioned conjugate gradient iterations from zero.

    memory: of a system like this one
    check:  called before each iteration, may raise
    """
    scale = scale_of(system)
    known = None if memory is None else memory.scaled(scale)

    def preconditioned(vector: Tensor) -> Tensor:
        return vector if known is None else known.precondition(vector)

    gradient = scale * total(Linear.gradient, system)
    solution, remaining = torch.zeros_like(gradient), gradient
    direction = better = preconditioned(remaining)
    length = remaining @ better
    directions, products = [], []
    for _ in range(iterations):
        check()
        step = scale * direction
        product = scale * total(lambda part, x=step: part.gram(x), system) + damping * direction
        curvature = direction @ product
        directions.append(direction * curvature.rsqrt())
        products.append(product * curvature.rsqrt())
        alpha = length / curvature
        solution = solution + alpha * direction
        remaining = remaining - alpha * product
        better = preconditioned(remaining)
        before, length = length, remaining @ better
        direction = better + (length / before) * direction
    # |r|^2 - |J x - r|^2 = 2 g . y - y . (A - lambda) y, and A y = g - remaining
    predicted = float(solution @ (gradient + remaining + damping * solution))
    found = Memory(torch.stack(directions), torch.stack(products)).scaled(1 / scale)
    return Solution(scale * solution, predicted, found)


def scale_of(system: Sequence[Linear]) -> Tensor:
    """s (H K + O,), which makes the diagonal of the system nearly 1."""
    blocks = total(Linear.diagonal, system).split(system[0].sizes)
    return torch.cat([torch.rsqrt(block + RIDGE * block.mean()) for block in blocks])


def total(task: Callable[[Linear], Tensor], system: Sequence[Linear]) -> Tensor:
    """The sum of what `task` makes of the parts, always in their order."""
    first, *others = parallel(task, system)
    for other in others:
        first += other
    return first
