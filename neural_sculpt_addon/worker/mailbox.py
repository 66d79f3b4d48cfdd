# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages from one process to another as numbered files of a private folder.

Neither side waits for the other, however slow or dead that is, and none needs a thread. Up to
Blender 5.0 a second thread that runs Python can crash it: in an operator that was called from
Python, Blender holds no lock of Python, and takes that of the other thread for its own. NumPy and
the standard library only.
"""

import contextlib
import math
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from . import protocol
from .protocol import Message, ProtocolError


class Outbox:
    """Where one process puts messages."""

    def __init__(self, folder: Path) -> None:
        """Put messages into an empty folder."""
        self.folder = folder
        self.count = 0
        """Messages put so far: the name of the next one."""

    def put(self, message: Message) -> None:
        """Write one message; it appears at once and as a whole. ProtocolError, OSError."""
        part = self.folder / "part"
        with part.open("wb") as file:
            protocol.write(file, message)
        os.replace(part, self.folder / str(self.count))
        self.count += 1


class Inbox:
    """Where the other one takes them, in the same order."""

    def __init__(self, folder: Path) -> None:
        """Take messages from the folder of an Outbox."""
        self.folder = folder
        self.count = 0
        """Messages taken so far: the name of the next one."""
        self._file: BinaryIO | None = None
        self._reading: Iterator[Message | None] = iter(())

    @property
    def amid(self) -> bool:
        """Whether a message has been read in part."""
        return self._file is not None

    def take(self, seconds: float = math.inf) -> Message | None:
        """The next message, which is removed; None when there is none yet. ProtocolError.

        None, too, when it is not read within so many seconds: the next call goes on with it.
        """
        path, start = self.folder / str(self.count), time.monotonic()
        if self._file is None:
            try:
                self._file = path.open("rb")
            except (FileNotFoundError, PermissionError):  # a virus scanner may look first
                return None
            except OSError as error:
                raise ProtocolError(f"A message cannot be opened ({error}).") from error
            self._reading = protocol.reading(self._file)
        message = None
        try:
            for message in self._reading:
                if message is None and time.monotonic() - start > seconds:
                    return None
        except ProtocolError:
            self._close()
            raise
        except OSError as error:
            self._close()
            raise ProtocolError(f"A message cannot be read ({error}).") from error
        self._close()
        if message is None:
            raise ProtocolError("A frame is empty.")
        with contextlib.suppress(OSError):
            path.unlink()
        self.count += 1
        return message

    def _close(self) -> None:
        assert self._file is not None
        self._file.close()
        self._file = None
