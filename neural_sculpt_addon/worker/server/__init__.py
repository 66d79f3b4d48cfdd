# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's process: its queue, its jobs and what it holds."""
