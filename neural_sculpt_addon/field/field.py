# SPDX-License-Identifier: GPL-3.0-or-later
"""The field: f(x) = network(x) + detail(x), negative inside, in model space.

The network holds the smooth whole, the detail what was sculpted or fitted beyond it.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from ..common.errors import SculptError
from .detail import Detail
from .evaluate import values_and_gradients
from .levels import Coefficients
from .network import FoldedSiren, Siren


class Sampled(NamedTuple):
    """A field at N points of model space."""

    f: NDArray[np.float32]  # (N,), negative inside
    gradient: NDArray[np.float32]  # (N, 3)


@dataclass(frozen=True)
class Field:
    """A network and its detail; an immutable value."""

    network: Siren
    detail: Detail = field(default_factory=Detail)

    @property
    def device(self) -> torch.device:
        """Where the tensors live."""
        return self.network.device

    @cached_property
    def folded(self) -> FoldedSiren:
        """The network as it is evaluated."""
        return FoldedSiren(self.network)

    def to(self, device: torch.device | str) -> "Field":
        """The same field on another device."""
        return Field(self.network.to(device), self.detail.to(device))

    def plus(self, coefficients: Coefficients, sign: int = 1) -> "Field":
        """This field with detail added, or with -1 taken away again, which is exact."""
        detail = self.detail.to("cpu").plus(coefficients, sign)
        return replace(self, detail=detail.to(self.device))

    def value(self, x: Tensor) -> Tensor:
        """f at points x (N, 3) -> (N,)."""
        value = self.folded.value(x)
        self.detail.add_value(x, value)
        return value

    def value_and_gradient(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """f (N,) and its gradient (N, 3) at points x (N, 3), in closed form, without autograd."""
        value, gradient = self.folded.value_and_gradient(x)
        self.detail.add_value_and_gradient(x, value, gradient)
        return value, gradient

    def sample(self, points: ArrayLike) -> Sampled:
        """f and its gradient at `points` (N, 3). SculptError when they are no such array."""
        x = np.asarray(points)
        if x.ndim != 2 or x.shape[1] != 3 or x.dtype.kind not in "fiu":
            raise SculptError(
                "Points are numbers (N, 3), not {} {}.", f"{x.dtype!s:.30}", f"{x.shape!s:.30}"
            )
        return Sampled(*values_and_gradients(self, x))
