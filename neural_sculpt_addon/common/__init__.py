# SPDX-License-Identifier: GPL-3.0-or-later
"""What every room uses: errors, progress and cancel, reading of JSON values, whole files."""
