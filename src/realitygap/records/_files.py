"""Write files so that a crash leaves the old file or the new one, and at worst an extra temporary file."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from realitygap.errors import RecordError

_FULL = {errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC)}
_FORBIDDEN = {errno.EACCES, errno.EPERM, errno.EROFS}
_NO_FOLDER_SYNC = {errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EBADF}
"""Errors of file systems that cannot sync a folder. Then a rename is as safe as they make it."""


def write_durably(path: Path, data: bytes, *, replace: bool) -> None:
    """Write `data` to a temporary file, sync it, rename it to `path`, and sync the folder.

    Args:
        path: File to make. Its folder must exist.
        data: Content of the file.
        replace: True to replace an existing file.

    Raises:
        RecordError: the file is there and shall not be replaced, or the system refused; nothing stays.
    """
    with writing(path), written_beside(path, [data]) as temporary:
        if not replace and path.exists():
            raise RecordError(f"{path} already exists. A published chunk is never overwritten.")
        temporary.replace(path)
        sync_folder(path.parent)


@contextlib.contextmanager
def written_beside(path: Path, parts: Iterable[bytes]) -> Iterator[Path]:
    """Write a file next to another one and sync it; it is deleted at the end if it was not renamed.

    Args:
        path: File that the new one may replace.
        parts: Content of the file, in parts.
    """
    # a random name, so that no other user can put a link there, and processes on several machines differ
    temporary = path.with_name(f".{path.name}.{secrets.randbits(63)}.tmp")
    try:
        with temporary.open("xb") as file:
            file.writelines(parts)
            file.flush()
            os.fsync(file.fileno())
        yield temporary
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Make renames and removals in a folder survive a loss of power; on Windows, nothing to call."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _NO_FOLDER_SYNC:
            raise
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn what the system says against writing `path` into advice.

    Raises:
        RecordError: in place of an `OSError`.
    """
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            advice = "Make room there (the disk, a quota or a limit on file sizes is full), then"
        elif error.errno in _FORBIDDEN:
            advice = "Make the folder writable for this account, then"
        else:
            advice = "When that is put right,"
        raise RecordError(
            f"Could not write {path}: {error.strerror or error}. Everything published before is safe. {advice} "
            "run the same command again to resume."
        ) from error


@contextlib.contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what the system says against reading `path` into one message.

    Raises:
        RecordError: in place of an `OSError`.
    """
    try:
        yield
    except FileNotFoundError as error:
        raise RecordError(f"{path} no longer exists. Another process may have removed it.") from error
    except OSError as error:
        raise RecordError(f"Could not read {path}: {error.strerror or error}.") from error
