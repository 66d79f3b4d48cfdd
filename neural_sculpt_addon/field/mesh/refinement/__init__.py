# SPDX-License-Identifier: GPL-3.0-or-later
"""Refinement of a proxy: its edges are split where they are off the surface."""
