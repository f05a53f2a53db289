"""Python files that the user has allowed to run: one saved answer for each hash of a file's text."""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

from realitygap.settings import visible

_HAS_OWNERS = hasattr(os, "getuid")
_IS_FOLDER = getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_NOFOLLOW", 0)


def source_hash(source: str) -> str:
    """Return the SHA-256 of a file's text, as hexadecimal digits."""
    # A text from JSON may hold half a surrogate pair, which UTF-8 has no bytes for.
    return hashlib.sha256(source.encode("utf-8", "surrogatepass")).hexdigest()


def answers_folder() -> Path:
    """Return the folder of the saved answers: in `REALITYGAP_STATE`, or in the user's folder for such files."""
    named = os.environ.get("REALITYGAP_STATE")
    if named:
        root = Path(named)
    elif sys.platform == "darwin":
        root = Path.home() / "Library" / "Application Support" / "realitygap"
    elif sys.platform == "win32":
        root = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "realitygap"
    else:
        states = Path(os.environ.get("XDG_STATE_HOME", ""))
        if not states.is_absolute():  # the XDG specification says to ignore a relative path
            states = Path.home() / ".local" / "state"
        root = states / "realitygap"
    return root / "allowed-code"


def is_allowed(digest: str) -> bool:
    """Return whether the user has allowed the file with this hash.

    An answer counts only if nobody else can have written it: folder and file are the user's own, are no links, and
    nobody else can write to them.
    """
    try:
        with _opened(answers_folder()) as folder:
            state = os.stat(_path(digest), dir_fd=folder, follow_symlinks=False)
    except (OSError, RuntimeError):
        return False
    return stat.S_ISREG(state.st_mode) and _is_private(state, stat.S_IWGRP | stat.S_IWOTH)


def remember_allowed(digest: str, file: str) -> None:
    """Save that the user has allowed the file with this hash.

    Args:
        digest: The hash of the file's text.
        file: Name of the file, for people who look into the folder.

    Raises:
        OSError: The folder cannot be made or written, is a link, or is not private to the user.
        RuntimeError: The user has no home folder.
    """
    path = answers_folder()
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
    with _opened(path) as folder, contextlib.suppress(FileExistsError):
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        descriptor = os.open(_path(digest), flags, 0o600, dir_fd=folder)
        with os.fdopen(descriptor, "w", encoding="ascii") as answer:
            answer.write(f"{visible(file)}\n")


@contextlib.contextmanager
def _opened(folder: Path) -> Iterator[int | None]:
    """Open the folder, so that it cannot be exchanged while in use; None on Windows, where profiles are private.

    Raises:
        OSError: There is none, it is a link, or it is not private to the user.
    """
    if not _HAS_OWNERS:
        yield None
        return
    descriptor = os.open(folder, os.O_RDONLY | _IS_FOLDER)
    try:
        if not _is_private(os.fstat(descriptor), stat.S_IRWXG | stat.S_IRWXO):
            raise PermissionError(1, "other users can open it, or own it", str(folder))
        yield descriptor
    finally:
        os.close(descriptor)


def _path(digest: str) -> str | Path:
    """Return the answer's name in the opened folder; its whole path on Windows."""
    return digest if _HAS_OWNERS else answers_folder() / digest


def _is_private(state: os.stat_result, forbidden: int) -> bool:
    if not _HAS_OWNERS:
        return True
    return state.st_uid == os.getuid() and not state.st_mode & forbidden
