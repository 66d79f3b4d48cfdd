# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods that are compared: ours and the paper's in `methods`, and those of others.

`published` is the paper's once more, as one epoch of it is published.
"""
