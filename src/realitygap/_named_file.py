"""Files that another file names, such as the image of a map: only plain files in the folder of that file.

Whoever wrote the file chose the name. It must not make a program wait for ever, or show what is elsewhere.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any, BinaryIO

from realitygap._limits import open_plain
from realitygap.settings import shown


class NamedFileError(ValueError):
    """A named file may not be read. The message can follow "FILE: KEY: "."""


def named_file(folder: Path, name: Any, *, or_folder: bool = False) -> Path:
    """Return the path of a file that another file in a folder names.

    Args:
        folder: Folder of the file that has the name in it.
        name: The name, as it is written there.
        or_folder: True if it may name a folder.

    Raises:
        NamedFileError: It is not the name of a plain file in the folder or below.
    """
    if not isinstance(name, str) or not name or "\0" in name:
        raise NamedFileError(f"expected the name of a file, got {shown(name)}.")
    path = folder / name
    try:
        is_inside = path.resolve().is_relative_to(folder.resolve())
        mode = path.stat().st_mode if is_inside else 0
    except FileNotFoundError:
        raise NamedFileError(f"there is no file {path}. Copy it there, or correct its name.") from None
    except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: links that lead to themselves
        raise NamedFileError(
            f"{shown(name)} cannot be read ({getattr(error, 'strerror', None) or error})."
        ) from None
    if not is_inside or not (stat.S_ISREG(mode) or (or_folder and stat.S_ISDIR(mode))):
        raise _refused(name)
    return path


def open_named(folder: Path, name: Any, most: int) -> BinaryIO:
    """Open a file that another file in a folder names, and never wait for the other end of a pipe.

    Args:
        folder: Folder of the file that has the name in it.
        name: The name, as it is written there.
        most: The largest number of bytes that it may have.

    Raises:
        NamedFileError: It is not the name of a plain file in the folder or below, or is too large.
    """
    path = named_file(folder, name)
    try:
        file = open_plain(path)
    except OSError as error:
        raise NamedFileError(f"{shown(name)} cannot be read ({error.strerror or error}).") from None
    if os.fstat(file.fileno()).st_size > most:
        file.close()
        raise NamedFileError(f"{shown(name)} has more than {most:,} bytes.")
    return file


def _refused(name: str) -> NamedFileError:
    return NamedFileError(
        f"expected a plain file in the same folder or below, got {shown(name)}. Copy the file there, and change its "
        "name."
    )
