# SPDX-License-Identifier: GPL-3.0-or-later
"""Hypothesis without clock and chance: slowness is no failure, examples are always the same."""

from hypothesis import HealthCheck, settings

settings.register_profile(
    "busy", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)
settings.load_profile("busy")
