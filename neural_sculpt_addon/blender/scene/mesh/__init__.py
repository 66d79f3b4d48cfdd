# SPDX-License-Identifier: GPL-3.0-or-later
"""The proxy as a mesh of Blender: filled, looked at, sculpted, masked, previewed."""
