# SPDX-License-Identifier: GPL-3.0-or-later
"""What attacks start inside Blender, by in_blender/start.py."""
