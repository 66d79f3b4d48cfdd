# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's own Python: which one it is, and how it is installed. Standard library only."""
