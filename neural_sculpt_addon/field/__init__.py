# SPDX-License-Identifier: GPL-3.0-or-later
"""The neural signed distance field: network and detail, files, sampling, edits, proxies. No bpy.

f(x) is negative inside, so its gradient points outward. All points are in model space. Scripts come
in by `load`:

    from neural_sculpt_addon.field import load

    f, gradient = load("bunny.safetensors").sample(points)  # (N,), (N, 3) at points (N, 3)
"""

from .checkpoint import load

__all__ = ["load"]
