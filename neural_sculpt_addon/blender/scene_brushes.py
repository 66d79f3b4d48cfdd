# SPDX-License-Identifier: GPL-3.0-or-later
"""Each scene's brush has curves of its own.

A copy of a scene points to the same curves as the scene that it was copied from, and Blender tells
nobody that a scene was copied: it is seen at the first update.
"""

import bpy
from bpy.app.handlers import persistent
from bpy.types import NodeTree, Scene

from .properties import GROUP


@persistent
def part(scene: Scene, *_: object) -> None:
    """After an update of a scene: copy the curves that another scene has, too."""
    brush = getattr(scene, GROUP)
    tree = brush.curves
    if tree is not None and tree.users > 1 and scene.library is None and _is_shared(scene, tree):
        brush.curves = tree.copy()


def _is_shared(scene: Scene, tree: NodeTree) -> bool:
    return any(getattr(other, GROUP).curves == tree for other in bpy.data.scenes if other != scene)


def register() -> None:
    """Listen to updates."""
    bpy.app.handlers.depsgraph_update_post.append(part)


def unregister() -> None:
    """Stop listening."""
    bpy.app.handlers.depsgraph_update_post.remove(part)
