# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of an edit: its result and the ground truth, how far apart they are, and times."""
