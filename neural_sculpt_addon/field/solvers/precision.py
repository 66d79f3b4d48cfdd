# SPDX-License-Identifier: GPL-3.0-or-later
"""In which numbers J is kept.

Processors that multiply bfloat16 do so four times as fast as float32. Its eight bits are enough for
the directions of a Gauss-Newton step, whose residuals stay in float32: what one step is wrong by,
the next one sees. On the scored strokes the errors are the same within 2 % either way.
"""

from functools import cache

import torch
from torch import Tensor

CAPABILITIES = "avx512_bf16", "amx_bf16"


def product_type(like: Tensor) -> torch.dtype:
    """Of J, where the network's numbers are `like` these."""
    coarse = like.dtype is torch.float32 and like.device.type == "cpu" and _multiplies_bfloat16()
    return torch.bfloat16 if coarse else like.dtype


@cache
def _multiplies_bfloat16() -> bool:
    known = torch.cpu.get_capabilities()
    return torch.backends.mkldnn.is_available() and any(known.get(name) for name in CAPABILITIES)
