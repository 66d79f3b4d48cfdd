# SPDX-License-Identifier: GPL-3.0-or-later
"""Damped linear least squares with a Jacobian that is never formed.

    minimise |J x - r|^2 + lambda |y|^2,  x = s y

The unknowns x are a matrix (H, K) and then a vector (O,), row after row. A row of J's first block
is an outer product left (x) right, or the sum of two, so products with J and its transpose are
products of matrices (N, width). The scale s of each unknown makes the diagonal of J^T J nearly 1.
The directions of the last system that was solved precondition the next one, which differs little
(Morales and Nocedal, "Automatic Preconditioning by Limited Memory Quasi-Newton Updating", 2000).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.linalg
import torch
from torch import Tensor

RIDGE = 0.002  # added to the diagonal of J^T J, in means of each block
FLOOR = 1e-3  # added to the diagonal of a second moment, in means of it


@dataclass(frozen=True)
class Linear:
    """J and r, rows weighted: n value rows, then m derivative rows.

    A derivative row is a sum of two outer products: the second one stands in the last m places of
    `left` and `right`, which may be of fewer bits than the others.
    """

    left: Tensor  # (n + 2 m, H)
    right: Tensor  # (n + 2 m, K)
    output: Tensor  # (n + m, O)
    residual: Tensor  # (n + m,)

    @property
    def values(self) -> int:
        """n."""
        return 2 * len(self.residual) - len(self.left)

    @property
    def inner(self) -> int:
        """H K, the unknowns of the first block."""
        return self.left.shape[1] * self.right.shape[1]

    def apply(self, x: Tensor) -> Tensor:
        """J x (n + m,), for x (H K + O,)."""
        n, count = self.values, len(self.residual)
        matrix = x[: self.inner].view(self.left.shape[1], -1).to(self.left.dtype)
        turned = torch.mm(self.left, matrix, out=self._space)
        terms = torch.linalg.vecdot(turned, self.right).to(x.dtype)  # (n + 2 m,)
        rows = torch.addmv(terms[:count], self.output, x[self.inner :])
        rows[n:] += terms[count:]
        return rows

    def transposed(self, rows: Tensor) -> Tensor:
        """J^T rows (H K + O,), for rows (n + m,)."""
        terms = torch.cat([rows, rows[self.values :]]).to(self.right.dtype)  # (n + 2 m,)
        weighted = torch.mul(self.right, terms[:, None], out=self._space)
        inner = weighted.T @ self.left  # (K, H): faster than (H, K)
        return torch.cat([inner.T.to(rows.dtype).ravel(), self.output.T @ rows])

    def gram(self, x: Tensor) -> Tensor:
        """J^T J x."""
        return self.transposed(self.apply(x))

    def diagonal(self) -> Tensor:
        """The diagonal of J^T J (H K + O,)."""
        n, count = self.values, len(self.residual)
        inner = (self.left**2).T @ (self.right**2)  # (H, K)
        first, second = slice(n, count), slice(count, None)
        inner += (
            2 * (self.left[first] * self.left[second]).T @ (self.right[first] * self.right[second])
        )
        outer = (self.output**2).sum(0)
        return torch.cat([inner.clamp_min(0).ravel().to(outer.dtype), outer])

    @cached_property
    def _space(self) -> Tensor:
        """Kept, because the system hands out fresh memory slowly (n + 2 m, K)."""
        return torch.empty_like(self.right)


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
    """What `solve` found."""

    x: Tensor  # (H K + O,)
    promised: float
    """The decrease |r|^2 - |J x - r|^2."""
    memory: Memory


def solve(
    linear: Linear,
    damping: float,
    iterations: int,
    memory: Memory | None,
    share: Callable[[float], None],
) -> Solution:
    """The solution after `iterations` preconditioned conjugate gradient iterations from zero.

    memory: of a system like this one
    share:  is told the part that is done before each iteration, and may raise
    """

    scale = scale_of(linear)
    known = None if memory is None else memory.scaled(scale)

    def preconditioned(vector: Tensor) -> Tensor:
        return vector if known is None else known.precondition(vector)

    gradient = scale * linear.transposed(linear.residual)
    solution, remaining = torch.zeros_like(gradient), gradient
    direction = better = preconditioned(remaining)
    length = dot(remaining, better)
    directions, products = [], []
    for iteration in range(iterations):
        share(iteration / iterations)
        product = scale * linear.gram(scale * direction) + damping * direction
        curvature = dot(direction, product)
        directions.append(direction * curvature.rsqrt())
        products.append(product * curvature.rsqrt())
        alpha = length / curvature
        solution = solution + alpha * direction
        remaining = remaining - alpha * product
        better = preconditioned(remaining)
        before, length = length, dot(remaining, better)
        direction = better + (length / before) * direction
    # |r|^2 - |J x - r|^2 = 2 g . y - y . (A - lambda) y, and A y = g - remaining
    promised = dot(solution, gradient + remaining + damping * solution)
    found = Memory(torch.stack(directions), torch.stack(products)).scaled(1 / scale)
    return Solution(scale * solution, float(promised), found)


def scale_of(linear: Linear) -> Tensor:
    """s (H K + O,), which makes the diagonal of the system nearly 1."""
    blocks = linear.diagonal().split([linear.inner, linear.output.shape[1]])
    return torch.cat([torch.rsqrt(block + RIDGE * block.mean()) for block in blocks])


def dot(a: Tensor, b: Tensor) -> Tensor:
    """a . b of vectors (N,), the same to the bit however many threads take part."""
    return (a[None] @ b)[0]


def eigenvectors(moment: Tensor) -> Tensor:
    """Eigenvectors (K, K) of a second moment (K, K), the weakest first.

    SciPy's, on one thread: torch's would wait for each other thousands of times, which can take
    seconds where another program has a core.
    """
    vectors = scipy.linalg.eigh(moment.cpu().numpy(), driver="evd")[1]
    return torch.from_numpy(vectors).to(moment)


def common_directions(first: Tensor, second: Tensor) -> Tensor:
    """Unit vectors (K, K) along which neither of two sets of rows is correlated, given their second
    moments (K, K).

    The generalised eigenvectors of these; they need not be orthogonal. A sum of two Kronecker
    products is diagonal in those of its factors (Martens and Grosse, "Optimizing Neural Networks
    with Kronecker-factored Approximate Curvature", 2015, appendix B).
    """
    one, other = (moment.double().cpu().numpy() for moment in (first, second))
    other = other + FLOOR * other.trace() / len(other) * np.eye(len(other))
    vectors = scipy.linalg.eigh(one, other)[1]
    return torch.from_numpy(vectors / np.linalg.norm(vectors, axis=0)).to(first)
