# SPDX-License-Identifier: GPL-3.0-or-later
"""Hypothesis as it suits a busy computer: what is slow there is not wrong."""

from hypothesis import HealthCheck, settings

settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy")
