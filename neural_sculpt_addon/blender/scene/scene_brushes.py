# SPDX-License-Identifier: GPL-3.0-or-later
"""Each scene's brush has curves of its own, and never points to curves that are gone.

A copy of a scene points to the same curves as the scene that it was copied from, and Blender tells
nobody that a scene was copied: it is seen at the first update. The older scene keeps the curves.

A step of Blender's history keeps a scene that is the same in both of its steps as it is, and frees
data-blocks that the step does not hold: a pointer to curves that were made in between would dangle,
and Blender crash. So scenes let go of their curves before a step, and take them again after it,
when they are still there.
"""

import bpy
from bpy.app.handlers import persistent
from bpy.types import NodeTree, Scene

from .properties import GROUP, NEURAL_SCULPT_PG_brush

_let_go: dict[int, int] = {}
"""By session_uid of a scene that of its curves, during a step of Blender's history."""


@persistent
def part(*_: object) -> None:
    """After an update of a scene: copy the curves that an older scene has, too."""
    first: dict[int, Scene] = {}
    for scene in sorted(_own_scenes(), key=lambda scene: scene.session_uid):
        tree = _brush(scene).curves
        if tree is not None and first.setdefault(tree.session_uid, scene) != scene:
            _brush(scene).curves = tree.copy()


@persistent
def let_go(*_: object) -> None:
    """Before undo and redo, when nothing pushes an undo step any more."""
    _let_go.clear()
    for scene in _own_scenes():
        if (tree := _brush(scene).curves) is not None:
            _let_go[scene.session_uid] = tree.session_uid
            _brush(scene).curves = None


@persistent
def take_again(*_: object) -> None:
    """After undo and redo."""
    trees: dict[int, NodeTree] = {tree.session_uid: tree for tree in bpy.data.node_groups}
    for scene in _own_scenes() if _let_go else ():
        tree = trees.get(_let_go.get(scene.session_uid, -1))
        if _brush(scene).curves is None and tree is not None:
            _brush(scene).curves = tree
    _let_go.clear()


def _own_scenes() -> list[Scene]:
    """Those of this file; a linked one is not ours to change."""
    return [scene for scene in bpy.data.scenes if scene.library is None]


def _brush(scene: Scene) -> NEURAL_SCULPT_PG_brush:
    return getattr(scene, GROUP)


_HANDLERS = (
    ("depsgraph_update_post", part),
    ("undo_pre", let_go),
    ("redo_pre", let_go),
    ("undo_post", take_again),
    ("redo_post", take_again),
)


def register() -> None:
    """Listen to updates and to Blender's history, after `history`, which may push a step."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening."""
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
