# SPDX-License-Identifier: GPL-3.0-or-later
"""What a profile or modulation can be: formulas, curve widgets, presets."""
