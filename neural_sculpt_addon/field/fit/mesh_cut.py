# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces cut along each other where they cross, exactly, by CGAL.

CGAL holds Python's lock as long as it cuts, which may be half a minute. So it does in a process of
its own: others see this one alive meanwhile, and can cancel it.
"""

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...common.child import clean_environ, exit_in_words, no_window
from ...common.errors import SculptError
from ...common.progress import Progress
from . import cgal_process

Array = NDArray[np.float64]

FEW = 200  # pairs that are cut at once, in less time than a process takes to start
TICK = 0.05  # seconds between two looks at `progress`
CUTTING = "Cutting faces that cross"
FAILED = (
    "Faces that cross could not be cut along each other ({}). Unite the parts of the mesh first,"
    " with Boolean or Remesh."
)


def cut_along(corners: Array, pairs: int, progress: Progress) -> tuple[Array, NDArray[np.int64]]:
    """Triangles (P, 3, 3) that the faces (F, 3, 3) are cut into, and of which each is a part (P,).

    pairs: how many of the faces cross each other, about

    SculptError when CGAL does not come to an end, or finds no place for its files.
    """
    progress(0.0, CUTTING)
    if pairs <= FEW:
        return cgal_process.cut(corners)
    try:
        return _cut_apart(corners, progress)
    except OSError as error:
        raise SculptError(FAILED, error.strerror or str(error)) from error


def _cut_apart(corners: Array, progress: Progress) -> tuple[Array, NDArray[np.int64]]:
    with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as made:
        np.save(given, corners, allow_pickle=False)
        given.seek(0)
        _run(given, made, progress)
        made.seek(0)
        return np.load(made, allow_pickle=False), np.load(made, allow_pickle=False)


def _run(given: BinaryIO, made: BinaryIO, progress: Progress) -> None:
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, "-I", str(Path(cgal_process.__file__))],
            stdin=given,
            stdout=made,
            stderr=said,
            env=clean_environ(),
            creationflags=no_window(),
        )
        try:
            while not _ended(process):
                progress(0.0, CUTTING)
        except BaseException:
            process.kill()
            raise
        finally:
            process.wait()
        if process.returncode:
            said.seek(0)
            tail = said.read().decode(errors="replace").strip()
            raise SculptError(FAILED, exit_in_words(process.returncode, tail))


def _ended(process: subprocess.Popen) -> bool:
    try:
        process.wait(TICK)
    except subprocess.TimeoutExpired:
        return False
    return True
