# SPDX-License-Identifier: GPL-3.0-or-later
"""The process between Blender and torch: protocol, client (Blender's side), server (torch's)."""
