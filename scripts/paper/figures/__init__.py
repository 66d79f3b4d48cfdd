# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's figures, a module each; `figures` has those of one edit by all methods.

`strokes` and strokes.json have the strokes of figures 1, 2 and 4.
"""
