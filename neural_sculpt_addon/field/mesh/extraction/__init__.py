# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching cubes on a sparse lattice: active cells, triangles, and both after an edit."""
