# SPDX-License-Identifier: GPL-3.0-or-later
"""Damped linear least squares with a Jacobian that is never formed.

    minimise |J delta - r|^2 + lambda |D^1/2 delta|^2

A row of J's inner block is an outer product left (x) right, or the sum of two, so products with J
and its transpose are products of matrices (N, width). D is the diagonal of J^T J; in coordinates in
which it nearly diagonalises J^T J it is also the preconditioner (EKFAC: George et al., "Fast
Approximate Natural Gradient Descent in a Kronecker-factored Eigenbasis", 2018).

On the CPU the rows are split among threads with one torch thread each: a product is one task per
thread, and no OpenMP region waits for a core that Blender is using.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import NamedTuple, TypeVar

import torch
from torch import Tensor

RIDGE = 0.01  # added to D, in means of each block
MOST_THREADS = 4
T = TypeVar("T")


class Delta(NamedTuple):
    """A change of the unknowns, or a gradient with respect to them."""

    inner: Tensor  # (H, A + 1)
    output: Tensor  # (H + 1,)

    def dot(self, other: "Delta") -> Tensor:
        """The inner product."""
        return (self.inner * other.inner).sum() + (self.output * other.output).sum()

    def times(self, factor: float) -> "Delta":
        """A multiple."""
        return Delta(factor * self.inner, factor * self.output)

    def scaled(self, other: "Delta") -> "Delta":
        """The product element by element."""
        return Delta(self.inner * other.inner, self.output * other.output)

    def plus(self, other: "Delta", factor: Tensor | float = 1.0) -> "Delta":
        """The sum with `factor` times another."""
        return Delta(self.inner + factor * other.inner, self.output + factor * other.output)


class Linear(NamedTuple):
    """J and r, rows weighted: n value rows, then m derivative rows.

    A derivative row is a sum of two outer products: the second one stands in the last m places of
    `left` and `right`.
    """

    left: Tensor  # (n + 2 m, H)
    right: Tensor  # (n + 2 m, A + 1)
    output: Tensor  # (n + m, H + 1)
    residual: Tensor  # (n + m,)

    @property
    def values(self) -> int:
        """n."""
        return 2 * len(self.residual) - len(self.left)

    def apply(self, delta: Delta) -> Tensor:
        """J delta (n + m,)."""
        n, count = self.values, len(self.residual)
        terms = ((self.right @ delta.inner.T) * self.left).sum(1)  # (n + 2 m,)
        rows = terms[:count] + self.output @ delta.output
        rows[n:] += terms[count:]
        return rows

    def transposed(self, rows: Tensor) -> Delta:
        """J^T rows, for rows (n + m,)."""
        terms = torch.cat([rows, rows[self.values :]])  # (n + 2 m,)
        return Delta((self.left * terms[:, None]).T @ self.right, self.output.T @ rows)

    def gram(self, delta: Delta) -> Delta:
        """J^T J delta."""
        return self.transposed(self.apply(delta))

    def diagonal(self) -> Delta:
        """The diagonal of J^T J."""
        n, count = self.values, len(self.residual)
        inner = (self.left**2).T @ (self.right**2)  # (H, A + 1)
        first, second = slice(n, count), slice(count, None)
        inner += (
            2 * (self.left[first] * self.left[second]).T @ (self.right[first] * self.right[second])
        )
        return Delta(inner.clamp_min(0), (self.output**2).sum(0))

    def split(self, parts: int) -> "list[Linear]":
        """The same rows in `parts` systems."""
        n, count = self.values, len(self.residual)
        m = count - n
        systems = []
        for part in range(parts):
            values = slice(n * part // parts, n * (part + 1) // parts)
            low, high = m * part // parts, m * (part + 1) // parts
            slopes, second = slice(n + low, n + high), slice(count + low, count + high)
            systems.append(
                Linear(
                    *(torch.cat([a[values], a[slopes], a[second]]) for a in self[:2]),
                    *(torch.cat([a[values], a[slopes]]) for a in self[2:]),
                )
            )
        return systems


def solve(
    linear: Linear, damping: float, iterations: int, share: Callable[[float], None]
) -> tuple[Delta, float]:
    """The solution after `iterations` preconditioned conjugate gradient iterations from zero.

    Returns delta and the decrease |r|^2 - |J delta - r|^2 that it promises. `share` is told the
    part that is done before each iteration and may raise.
    """
    parts = linear.split(_threads()) if linear.residual.device.type == "cpu" else [linear]

    def total(part: Callable[[Linear], Delta]) -> Delta:
        first, *others = _each(part, parts)
        for other in others:
            first = first.plus(other)
        return first

    diagonal = total(Linear.diagonal)
    scale = Delta(*(torch.rsqrt(block + RIDGE * block.mean()) for block in diagonal))
    gradient = total(lambda part: part.transposed(part.residual)).scaled(scale)
    solution = gradient.scaled(Delta(*(torch.zeros(()).to(block) for block in gradient)))
    remaining = direction = gradient
    length = remaining.dot(remaining)
    for iteration in range(iterations):
        share(iteration / iterations)
        step = direction.scaled(scale)
        product = total(lambda part, step=step: part.gram(step)).scaled(scale)
        product = product.plus(direction, damping)
        alpha = length / direction.dot(product)
        solution = solution.plus(direction, alpha)
        remaining = remaining.plus(product, -alpha)
        before, length = length, remaining.dot(remaining)
        direction = remaining.plus(direction, length / before)
    # of a solution of the damped normal equations: |r|^2 - |J delta - r|^2
    promised = solution.dot(gradient) + damping * solution.dot(solution)
    return solution.scaled(scale), float(promised)


def _each(task: Callable[[Linear], T], parts: list[Linear]) -> list[T]:
    return [task(parts[0])] if len(parts) == 1 else list(_pool().map(task, parts))


def _threads() -> int:
    return max(1, min(MOST_THREADS, os.cpu_count() or 1))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_threads(), "solve", initializer=torch.set_num_threads, initargs=(1,))
