# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that appear whole or not at all."""

import os
import tempfile
from contextlib import suppress
from pathlib import Path

from .errors import SculptError


def write_whole(path: Path, data: bytes) -> None:
    """Write `data` to `path` by way of a temporary file beside it. SculptError when that fails."""
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            with suppress(OSError):  # a USB stick may have no modes
                os.chmod(temporary, 0o666 & ~_umask())
            os.replace(temporary, path)
        except BaseException:
            with suppress(FileNotFoundError):  # it is in its place already
                os.unlink(temporary)
            raise
    except OSError as error:
        raise SculptError(
            "{} cannot be written: {}. Choose another folder or file name.", path, error.strerror
        ) from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
