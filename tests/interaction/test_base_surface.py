# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that a stroke is drawn on."""

import unittest

import numpy as np

from tests.blender.geometry import square
from tests.interaction.support import module

base_surface = module("interaction.base_surface")
finish = module("interaction.steps").finish


class LargeFans(unittest.TestCase):
    """Triangles of which so many are sorted in several blocks."""

    def test_the_triangles_around_vertices_are_those_with_one_as_a_corner(self) -> None:
        points, triangles = square(400)
        self.assertGreater(len(triangles), 2 * base_surface.BLOCK)
        fans = finish(base_surface.Fans.sorting(triangles, len(points)))
        random = np.random.default_rng(5)
        for count in 1, 40, 3000:
            vertices = random.choice(len(points), count, replace=False)
            wanted = triangles[np.isin(triangles, vertices).any(axis=1)]
            np.testing.assert_array_equal(fans.around(vertices), wanted)
        ends = np.array([0, len(points) - 1])
        wanted = triangles[np.isin(triangles, ends).any(axis=1)]
        np.testing.assert_array_equal(fans.around(ends), wanted)
        np.testing.assert_array_equal(fans.ring(ends), np.unique(wanted))
