# SPDX-License-Identifier: GPL-3.0-or-later
"""What the .blend holds, and how it changes: fields, histories, brushes, undo steps."""
