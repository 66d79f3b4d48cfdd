# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over and on the field, and how the mouse finds it."""
