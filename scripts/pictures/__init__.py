# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of fields, and of them on a page.

    field_picture         a field itself, by rays, without Blender
    rendered              meshes of fields, by Blender
    sheet                 labels, curves, rows and columns
    supports, refinement  those of docs/method.md

Arrays (height, width, 3) of bytes.
"""
