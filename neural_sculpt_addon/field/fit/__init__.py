# SPDX-License-Identifier: GPL-3.0-or-later
"""From a triangle mesh to a field: clean-up, signed distance, fits, consolidation."""
