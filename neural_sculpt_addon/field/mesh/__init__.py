# SPDX-License-Identifier: GPL-3.0-or-later
"""From a field to triangles: active cells, extraction, update after an edit, pieces, samples."""
