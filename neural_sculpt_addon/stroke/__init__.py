# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist draws: curve, frame, profile, modulation, brush, stroke.

NumPy and the standard library only; used on both sides of the pipe. All lengths are in model
space, where the shape lies inside [-0.85, 0.85]^3 of the box [-1, 1]^3.
"""
