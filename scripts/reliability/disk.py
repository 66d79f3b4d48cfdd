# SPDX-License-Identifier: GPL-3.0-or-later
"""A disk with as little room as one likes: a file system of its own with a file that fills it."""

import os
from contextlib import suppress
from pathlib import Path

PAGE = 4096
"""Bytes by which a file there grows."""

MEGABYTES = 256
MOUNT = f'mount -t tmpfs -o size={MEGABYTES}m tmpfs "$0" && exec "$@"'


def command(folder: Path, *inner: str) -> list[str]:
    """The command with a disk of its own at `folder`, which nobody else sees; without root."""
    return ["unshare", "--map-root-user", "--mount", "sh", "-c", MOUNT, str(folder), *inner]


def fill(folder: Path, pages: int = 0) -> None:
    """Leave room for so many pages."""
    with (folder / "ballast").open("wb") as file:
        while (room := os.statvfs(folder)).f_bavail > pages:
            with suppress(OSError):  # a worker that still writes has just taken some
                size = os.fstat(file.fileno()).st_size
                os.posix_fallocate(file.fileno(), size, (room.f_bavail - pages) * room.f_frsize)


def clear(folder: Path) -> None:
    """Make all the room that there was."""
    (folder / "ballast").unlink(missing_ok=True)
