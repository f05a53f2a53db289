"""The cache of compiled kernels: one sealed file per kernel and signature, in a folder private to the user."""

from __future__ import annotations

import hashlib
import os
import pickle
import stat
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import caching, serialize
from numba.core.compiler import CompileResult

SEAL_SIZE = hashlib.sha256().digest_size


def sources_hash() -> str:
    """Return a hash of all kernel sources, of Numba's version, and of Python's version.

    An edit of a kernel changes the machine code of its callers in other files. So the hash covers all files.
    """
    digest = hashlib.sha256(f"{numba.__version__} {sys.implementation.cache_tag}".encode())
    folder = Path(__file__).parent
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_root() -> Path:
    """Return the folder for compiled kernels: `REALITYGAP_CACHE`, or the user's cache folder."""
    named = os.environ.get("REALITYGAP_CACHE")
    if named:
        return Path(named)
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "realitygap"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "realitygap"
    caches = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not caches.is_absolute():  # the XDG specification says to ignore a relative path
        caches = Path.home() / ".cache"
    return caches / "realitygap"


def private_folder(root: Path) -> Path:
    """Return the cache folder of the present sources, after making it and checking who can write to it.

    Loading a compiled kernel runs machine code, so nobody else may put a file there. On Windows the
    profile folder of a user is private already.

    Raises:
        OSError: The folder cannot be made or written, or another user could write to it.
    """
    folder = root / f"kernels-{sources_hash()}"
    root.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if hasattr(os, "getuid"):
        root_state = root.stat()
        if root_state.st_mode & stat.S_IWOTH and not root_state.st_mode & stat.S_ISVTX:
            raise PermissionError(0, f"every user can write to {root}")
        # O_NOFOLLOW: another user could have put a link in its place.
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        try:
            if os.fstat(descriptor).st_uid != os.getuid():
                raise PermissionError(0, "another user owns it")
            os.fchmod(descriptor, 0o700)
        finally:
            os.close(descriptor)
    with tempfile.TemporaryFile(dir=folder):
        pass
    return folder


def usable_folder() -> Path | None:
    """Return the cache folder, or None after one warning if it cannot be used."""
    root = cache_root()
    try:
        return private_folder(root)
    except OSError as error:
        warnings.warn(
            f"Compiled kernels cannot be saved in {root} ({error.strerror}): each start compiles them again. "
            "Set REALITYGAP_CACHE to a folder that only you can write to.",
            RuntimeWarning,
            stacklevel=2,
        )
        return None


def read_sealed(path: Path) -> Any:
    """Return the object in a sealed file.

    Raises:
        OSError: The file cannot be read.
        ValueError: Its content does not have the checksum that the file begins with.
    """
    content = path.read_bytes()
    seal, payload = content[:SEAL_SIZE], content[SEAL_SIZE:]
    if hashlib.sha256(payload).digest() != seal:
        raise ValueError(f"{path} is damaged")
    return pickle.loads(payload)


def write_sealed(path: Path, value: Any) -> None:
    """Write an object behind the SHA-256 checksum of its bytes; the file appears whole or not at all."""
    payload = serialize.dumps(value)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=".writing-")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(hashlib.sha256(payload).digest())
            file.write(payload)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


class SealedCache(caching._Cache):  # type: ignore[misc]
    """Numba's cache of one function. A file that is missing, damaged or not writable means compiling again."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
        self._code = hashlib.sha256(function.__code__.co_code).hexdigest()
        self._folder = folder

    @property
    def cache_path(self) -> str:
        """The folder of the files."""
        return str(self._folder)

    def _key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        return (self._name, self._code, signature, codegen.magic_tuple())

    def _path(self, key: tuple[Any, ...]) -> Path:
        return self._folder / f"{self._name}-{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.kernel"

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return the compiled function, or None if it has to be compiled."""
        target_context.refresh()
        key = self._key(signature, target_context.codegen())
        try:
            stored, reduced = read_sealed(self._path(key))
        except (OSError, ValueError):
            return None
        # Shortened hashes could agree by chance.
        return CompileResult._rebuild(target_context, *reduced) if stored == key else None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Save the compiled function, unless that fails: the function works without its file."""
        key = self._key(signature, compiled.codegen)
        try:
            write_sealed(self._path(key), (key, compiled._reduce()))
        except OSError:
            pass

    def enable(self) -> None:
        """Do nothing: the cache is always on."""

    def disable(self) -> None:
        """Do nothing: the cache is always on."""

    def flush(self) -> None:
        """Do nothing: a file is replaced when its kernel is compiled again."""
