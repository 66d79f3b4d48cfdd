# SPDX-License-Identifier: GPL-3.0-or-later
"""The device that the worker sculpts on: the processor, or a graphics card that passed a small
stroke.

Fits run on the processor in any case.
"""

import logging
from typing import TYPE_CHECKING

from ...common.errors import SculptError
from ..install.environment import Device

if TYPE_CHECKING:
    import torch

logger = logging.getLogger(__name__)


def choose(wanted: Device) -> "torch.device":
    """The device for what was asked for. SculptError when it is not there, or cannot sculpt."""
    import torch

    if wanted is Device.CPU or (wanted is Device.AUTO and not torch.cuda.is_available()):
        return torch.device("cpu")
    if not torch.cuda.is_available():
        raise SculptError(
            "The worker's PyTorch sees no CUDA graphics card. Choose another device in the"
            " preferences, or a Worker Python whose PyTorch is made for CUDA."
        )
    try:
        try_out(torch.device("cuda"))
    except Exception as error:  # of the driver, of PyTorch, of ours: it is of no use in any case
        logger.exception("CUDA cannot be used")
        if wanted is Device.CUDA:
            raise SculptError(
                "The graphics card cannot be used ({}). Choose another device in the preferences.",
                error,
            ) from error
        return torch.device("cpu")
    return torch.device("cuda")


def try_out(device: "torch.device") -> None:
    """A small stroke on a device, which must succeed."""
    from ...field.edit.edit import edit
    from ...field.primitives import primitive
    from ...field.projection import project
    from ...stroke.brush import Brush
    from ...stroke.stroke import Stroke

    sphere = primitive("sphere")
    points = project(sphere, [(0.1 * x, 0.0, 0.6) for x in (-1, 0, 1)]).points
    edit(sphere.to(device), [Stroke(points.astype(float), Brush(0.1, 0.02))])
