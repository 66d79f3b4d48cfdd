# SPDX-License-Identifier: GPL-3.0-or-later
"""The field as an OpenVDB level set, where Blender brings OpenVDB for Python.

The builds of blender.org do so from 4.5 on.
"""

from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ....common.errors import SculptError

SUFFIX = ".vdb"
GRID_NAME = "surface"  # of the grid, as level sets are called elsewhere


def check() -> None:
    """SculptError when this Blender cannot write such files."""
    if hasattr(bpy.utils, "expose_bundled_modules"):
        bpy.utils.expose_bundled_modules()
    try:
        import openvdb  # noqa: F401  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise SculptError(
            "This Blender has no OpenVDB for Python. Use Blender 4.5 or newer from blender.org,"
            " or export a mesh."
        ) from error


def write(path: Path, band: NDArray[np.float32], matrix: Matrix, scale: float) -> None:
    """Write a narrow band as a level set. SculptError when the file cannot be written.

    band:   (n, n, n), f on the lattice that spans the box, cut off where it is largest
    matrix: from model space to the scene
    scale:  length in the scene of one unit of model space
    """
    check()
    import openvdb  # pyright: ignore[reportMissingImports]

    voxel = 2 / (len(band) - 1)
    border = scale * float(band.max())
    grid = openvdb.FloatGrid(border)
    distance = scale * band
    grid.copyFromArray(np.where(distance <= -border, border, distance))
    grid.signedFloodFill()  # what lies inside the band is inside
    grid.gridClass = openvdb.GridClass.LEVEL_SET
    grid.name = GRID_NAME
    corner = Matrix.Translation((-1.0, -1.0, -1.0)) @ Matrix.Scale(voxel, 4)
    to_scene = (matrix @ corner).transposed()  # OpenVDB multiplies from the left
    try:
        grid.transform = openvdb.createLinearTransform(np.array(to_scene).tolist())
    except ArithmeticError as error:  # the volume of a voxel counts as 0
        raise SculptError(
            "{} was not written: its voxels are too small for OpenVDB. Scale the object up, or"
            " lower the resolution.",
            path.name,
        ) from error
    try:
        openvdb.write(str(path), grids=[grid])
    except (RuntimeError, OSError) as error:
        raise SculptError("{} was not written: {}.", path.name, error) from error
