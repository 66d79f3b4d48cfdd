# SPDX-License-Identifier: GPL-3.0-or-later
"""What a stroke asks of the field: lay, tube, folds, and how well it was met."""
