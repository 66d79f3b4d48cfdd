# SPDX-License-Identifier: GPL-3.0-or-later
"""From a field to triangles: the proxy, connected components, samples of the surface, files."""
