"""A lock that admits one writer at a time to a folder of results."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import warnings
from collections.abc import Callable
from pathlib import Path

from realitygap.errors import RecordError
from realitygap.records._files import writing
from realitygap.records._inside import open_inside
from realitygap.records._version import RecordWarning

LOCK_NAME = ".lock"


class FolderLock:
    """A lock on a folder which the operating system releases when the holder dies, however it dies.

    The holder may take it again, also from other threads; it is released with the last of them. The file
    stays where it is: removing it would let two writers lock two different files of one name.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._path = folder / LOCK_NAME
        self._mutex = threading.Lock()
        self._depth = 0
        self._descriptor = -1

    def acquire(self, on_first: Callable[[], None]) -> None:
        """Take the lock; `on_first` is called under it unless it was held already.

        Raises:
            RecordError: another writer holds it, the folder cannot be written, or the file is a link.
        """
        with self._mutex:
            if self._depth == 0:
                self._take()
                try:
                    on_first()
                except BaseException:
                    self._drop()
                    raise
            self._depth += 1

    def release(self) -> None:
        """Give the lock back, once for every `acquire`."""
        with self._mutex:
            self._depth -= 1
            if self._depth == 0:
                self._drop()

    def _take(self) -> None:
        with writing(self._path):
            descriptor = open_inside(self._folder, self._path, os.O_RDWR | os.O_CREAT)
        try:
            lock_descriptor(descriptor)
        except (BlockingIOError, PermissionError) as error:
            holder = _read_holder(descriptor)
            os.close(descriptor)
            raise RecordError(
                f"{self._folder} is in use: {holder} writes to it. "
                "Wait until it ends, stop it, or name another folder."
            ) from error
        except OSError as error:
            warnings.warn(
                f"{self._folder}: this file system cannot lock files ({error.strerror}). "
                "Make sure yourself that only one process at a time writes to this folder.",
                RecordWarning,
                stacklevel=5,
            )
        self._descriptor = descriptor
        _write_holder(descriptor, f"process {os.getpid()} on {socket.gethostname()}")

    def _drop(self) -> None:
        _write_holder(self._descriptor, "")
        os.close(self._descriptor)
        self._descriptor = -1


def _read_holder(descriptor: int) -> str:
    with contextlib.suppress(OSError):
        os.lseek(descriptor, 0, os.SEEK_SET)
        return os.read(descriptor, 300).decode("utf-8", "replace").strip() or "another process"
    return "another process"


def _write_holder(descriptor: int, text: str) -> None:
    """Write the holder of the lock, for the message to others; on a full disk the lock works without it."""
    with contextlib.suppress(OSError):
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, text.encode())


if sys.platform == "win32":
    import msvcrt

    _FAR_BYTE = 1 << 30
    """Windows keeps others from reading a locked byte; this one lies beyond the text."""

    def lock_descriptor(descriptor: int) -> None:
        """Lock an open file, or raise an OSError; the lock ends with the process."""
        os.lseek(descriptor, _FAR_BYTE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def lock_descriptor(descriptor: int) -> None:
        """Lock an open file, or raise an OSError; the lock ends with the process."""
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
