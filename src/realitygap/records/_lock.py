"""A lock that admits one writer at a time to a folder of results, or to the trials of a command."""

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
    """A lock on a folder, or a file, which the operating system releases when the holder dies, however it dies.

    The holder may take it again, also from other threads; it is released with the last of them. The lock's own file
    stays in a folder; next to a file it is removed, and whoever locked a removed one takes the lock again.

    Args:
        folder: Folder of the lock.
        file: Name of the locked file in the folder. Default: the folder is locked.
    """

    def __init__(self, folder: Path, file: str = "") -> None:
        self._folder, self._locked = folder, folder / file
        self._path = folder / (f".{file}{LOCK_NAME}" if file else LOCK_NAME)
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
            if not self._is_there(descriptor):
                os.close(descriptor)
                self._take()
                return
        except (BlockingIOError, PermissionError) as error:
            holder = _read_holder(descriptor)
            os.close(descriptor)
            raise RecordError(
                f"{self._locked} is in use: {holder} writes to it. Wait until it ends, stop it, or name another "
                f"{'folder' if self._locked == self._folder else 'file'}."
            ) from error
        except OSError as error:
            warnings.warn(
                f"{self._locked}: this file system cannot lock files ({error.strerror}). "
                "Make sure yourself that only one process at a time writes to it.",
                RecordWarning,
                stacklevel=5,
            )
        self._descriptor = descriptor
        _write_holder(descriptor, f"process {os.getpid()} on {socket.gethostname()}")

    def _is_there(self, descriptor: int) -> bool:
        """Return whether the open file is still the one at the path."""
        try:
            return os.path.samestat(os.fstat(descriptor), self._path.stat())
        except FileNotFoundError:
            return False

    def _drop(self) -> None:
        if self._locked == self._folder:
            _write_holder(self._descriptor, "")
        else:
            with contextlib.suppress(OSError):  # Windows removes no file that is open
                self._path.unlink()
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
