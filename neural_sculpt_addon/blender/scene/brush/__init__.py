# SPDX-License-Identifier: GPL-3.0-or-later
"""The brush of the next stroke: what the .blend stores of it, and what is drawn with it."""
