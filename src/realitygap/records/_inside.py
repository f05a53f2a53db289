"""Functions that write inside a folder of any origin, but never through a link, a pipe, or a device.

The user names the folder, so the folder itself may be a link. Whoever made the folder chose the names in it: a link
there would let them have any file of the user overwritten. The functions do not protect from others who change the
folder at the same moment.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from realitygap.errors import RecordError

_SAFE_FLAGS = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY"))
"""Flags to open a file for writing: never follow a link, and never wait for the other end of a pipe."""

_JUNCTION = getattr(stat, "IO_REPARSE_TAG_MOUNT_POINT", -1)
"""Windows' link to a folder, which is not a symbolic link there."""


def refuse_links(folder: Path, *paths: Path) -> None:
    """Raise an error if a path inside a folder, or a part of it, is not a plain file or folder.

    Args:
        folder: Folder as the user named it. It may be a link itself.
        paths: Inside it; those that do not exist are fine.

    Raises:
        RecordError: A name is a link, a pipe or a device.
    """
    for path in paths:
        below = path.relative_to(folder)
        for n_parts in range(1, len(below.parts) + 1):
            name = folder.joinpath(*below.parts[:n_parts])
            try:
                status = name.lstat()
            except (FileNotFoundError, NotADirectoryError):
                break
            _refuse_unless_plain(name, status)


def refuse_links_in(folder: Path, *subfolders: str) -> None:
    """Raise an error if a subfolder, or an entry in it, is not a plain file or folder.

    Raises:
        RecordError: A name is a link, a pipe or a device.
    """
    for name in subfolders:
        refuse_links(folder, folder / name)
        if (folder / name).is_dir():
            refuse_links(folder, *(folder / name).iterdir())


def open_inside(folder: Path, path: Path, flags: int) -> int:
    """Open a file in a folder for writing in place.

    Args:
        folder: Folder as the user named it.
        path: Inside it.
        flags: Flags of `os.open`.

    Returns:
        The descriptor.

    Raises:
        OSError: The system refused.
        RecordError: The file, or a name on the way to it, is a link, a pipe or a device, or the file has other names.
    """
    refuse_links(folder, path)
    descriptor = os.open(path, flags | _SAFE_FLAGS, 0o666)
    try:
        status = os.fstat(descriptor)
        _refuse_unless_plain(path, status)
        refuse_other_names(path, status)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def refuse_other_names(path: Path, status: os.stat_result) -> None:
    """Raise an error if a file that is written in place has other names, by which it belongs elsewhere, too.

    Raises:
        RecordError: It has hard links.
    """
    if status.st_nlink > 1:
        raise RecordError(
            f"{path} has {status.st_nlink} names (hard links), and writing would change the file under all of them. "
            "Nothing was written. Put a copy in its place."
        )


def _refuse_unless_plain(path: Path, status: os.stat_result) -> None:
    if stat.S_ISLNK(status.st_mode) or getattr(status, "st_reparse_tag", 0) == _JUNCTION:
        raise RecordError(
            f"{path} is a link, and realitygap does not write through links inside a folder. Nothing was written. "
            "Remove the link, or put what it leads to in its place."
        )
    if not stat.S_ISREG(status.st_mode) and not stat.S_ISDIR(status.st_mode):
        raise RecordError(
            f"{path} is a pipe, a socket or a device, expected a plain file. Nothing was written. Remove it, or name "
            "another folder."
        )
