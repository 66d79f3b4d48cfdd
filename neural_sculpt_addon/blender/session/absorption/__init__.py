# SPDX-License-Identifier: GPL-3.0-or-later
"""Absorption: what Blender's brushes do to a proxy, on its way into the field."""
