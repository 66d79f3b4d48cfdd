# SPDX-License-Identifier: GPL-3.0-or-later
"""Attacks: `stress.py` runs each module here; its docstring tells what such a module has."""
