# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators on a field: how it comes, what becomes of it, where it goes."""
