# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar of the 3D viewport, one panel a file, from top to bottom: model, brush, stroke,
history, proxy, worker."""
