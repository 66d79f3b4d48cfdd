# SPDX-License-Identifier: GPL-3.0-or-later
"""Neural Sculpt: sculpt a neural signed distance field by strokes.

Importing this package needs neither Blender nor torch: only `register` touches Blender, and only
the worker's own process, another Python, loads torch.
"""


def register() -> None:
    """Add Neural Sculpt to the running Blender."""
    from .blender import registration

    registration.register()


def unregister() -> None:
    """Remove every trace of Neural Sculpt from the running Blender and stop the worker."""
    from .blender import registration

    registration.unregister()
