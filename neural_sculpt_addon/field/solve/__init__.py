# SPDX-License-Identifier: GPL-3.0-or-later
"""Solvers: a problem in, a layer of detail or another network out."""
