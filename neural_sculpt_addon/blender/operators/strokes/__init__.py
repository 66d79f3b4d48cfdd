# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators on strokes: drawing, the history, shapes."""
