# SPDX-License-Identifier: GPL-3.0-or-later
"""The neural signed distance field: network, files, sampling, edits, proxies. No bpy here.

f(x) is negative inside, so its gradient points outward. All points are in model space.
"""
