# SPDX-License-Identifier: GPL-3.0-or-later
"""A function that Blender calls whenever it draws a 3D viewport."""

from collections.abc import Callable
from typing import Any, Literal

import bpy
from bpy.types import SpaceView3D

When = Literal["POST_VIEW", "POST_PIXEL"]
"""After the scene, in world space; after the interface, in pixels of the region."""


class DrawHandler:
    """One such function, which stays from registration to its end."""

    def __init__(self, draw: Callable[[], None], when: When = "POST_VIEW") -> None:
        """Blender calls nothing before `add`."""
        self.draw, self._when = draw, when
        self._handle: Any = None

    def add(self) -> None:
        """Let Blender call it; without a window there is nothing to draw on."""
        if not bpy.app.background:
            self._handle = SpaceView3D.draw_handler_add(self.draw, (), "WINDOW", self._when)

    def remove(self) -> None:
        """Draw no more."""
        if self._handle is not None:
            SpaceView3D.draw_handler_remove(self._handle, "WINDOW")
            self._handle = None
