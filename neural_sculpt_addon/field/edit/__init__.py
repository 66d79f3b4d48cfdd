# SPDX-License-Identifier: GPL-3.0-or-later
"""From one state of a field to the next: edits, layers, brushes, Booleans."""
