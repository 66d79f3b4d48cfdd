# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sees: properties, operators, panels, proxy mesh, history, preferences.

The object in the .blend owns the truth; the worker is a cache that may be killed at any time.
Everything here runs on Blender's main thread.
"""

ADDON = __package__.rpartition(".")[0]
"""The add-on's own name, `bl_ext.user_default.neural_sculpt` when installed as an extension."""
