# SPDX-License-Identifier: GPL-3.0-or-later
"""The jobs of the worker: their queue, what they ask, what becomes of their results."""
