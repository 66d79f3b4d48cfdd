# SPDX-License-Identifier: GPL-3.0-or-later
"""What follows mouse and pen: recorder, ribbon, preview, ray grid, presets. No bpy: NumPy only."""
