"""The cache of compiled kernels: one sealed file per kernel and signature, in a folder private to the user."""

from __future__ import annotations

import ast
import functools
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

import llvmlite.binding
import numba
from numba.core import caching, serialize
from numba.core.compiler import CompileResult

from ._compiling import begin_compiling, end_compiling

_FOLDER = Path(__file__).parent

# They decide how everything is compiled, and what a file holds.
_COMPILER = {"_cache", "_compile"}

SEAL_SIZE = hashlib.sha256().digest_size


def _imported(module: str) -> set[str]:
    """Return the modules of this package that a module of it imports."""
    tree = ast.parse((_FOLDER / f"{module}.py").read_bytes())
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level == 1]
    return {
        name
        for node in imports
        for name in ([node.module] if node.module else [alias.name for alias in node.names])
        if (_FOLDER / f"{name}.py").exists()
    }


@functools.cache
def sources_hash(module: str) -> str:
    """Return a hash of the sources of a module of kernels, of Numba's version, and of Python's version.

    An edit of a kernel changes the machine code of its callers in other files. So the hash covers all modules
    that are imported, by one another too. Of a kernel elsewhere it covers all modules of this package.

    Args:
        module: Full name.
    """
    digest = hashlib.sha256(f"{numba.__version__} {sys.implementation.cache_tag}".encode())
    package, _, name = module.rpartition(".")
    covered: set[str] = set()
    missing = {name} if package == __package__ else {path.stem for path in _FOLDER.glob("*.py")}
    missing |= _COMPILER
    while missing:
        covered |= missing
        missing = set().union(*map(_imported, missing)) - covered
    for name in sorted(covered):
        digest.update(name.encode())
        digest.update((_FOLDER / f"{name}.py").read_bytes())
    return digest.hexdigest()


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
    """Return the cache folder, after making it and checking who can write to it.

    Loading a compiled kernel runs machine code, so nobody else may put a file there. On Windows the
    profile folder of a user is private already.

    Raises:
        OSError: The folder cannot be made or written, or another user could write to it.
    """
    folder = root / "kernels"
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


def _without_bitcode(compiled: Any) -> Any:
    """Return what Numba would store, less what callers would link: a kernel's callers compile it for themselves.

    That was nine tenths of a file, and LLVM parsed it at each start. The names are what Numba looks for.
    """
    reduced = compiled._reduce()
    (library, kind, data), *others = reduced
    if kind != "object":
        return reduced
    names = (compiled.fndesc.llvm_func_name, compiled.fndesc.llvm_cpython_wrapper_name)
    symbols = "".join(f'define void @"{name}"() {{ ret void }}\n' for name in names)
    bitcode = llvmlite.binding.parse_assembly(symbols).as_bitcode()
    return ((library, kind, (data[0], bitcode)), *others)


class SealedCache(caching._Cache):  # type: ignore[misc]
    """Numba's cache of one function. A file that is missing, damaged or not writable means compiling again."""

    def __init__(self, function: Callable[..., Any], folder: Path, way: str = "") -> None:
        self._module = function.__module__
        self._name = f"{self._module.rpartition('.')[2]}.{function.__qualname__}"
        self._way = way
        self._code = hashlib.sha256(function.__code__.co_code).hexdigest()
        self._folder = folder

    @property
    def cache_path(self) -> str:
        """The folder of the files."""
        return str(self._folder)

    @functools.cached_property
    def _sources(self) -> str:
        return sources_hash(self._module)

    def _key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        return (self._name, self._sources, self._code, self._way, signature, codegen.magic_tuple())

    def _path(self, key: tuple[Any, ...]) -> Path:
        return self._folder / f"{self._name}-{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.kernel"

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return the compiled function, or None if it has to be compiled."""
        target_context.refresh()
        key = self._key(signature, target_context.codegen())
        try:
            stored, reduced = read_sealed(self._path(key))
        except (OSError, ValueError):
            begin_compiling(self._name)
            return None
        # Shortened hashes could agree by chance.
        return CompileResult._rebuild(target_context, *reduced) if stored == key else None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Save the compiled function, unless that fails: the function works without its file."""
        end_compiling(self._name)
        key = self._key(signature, compiled.codegen)
        try:
            write_sealed(self._path(key), (key, _without_bitcode(compiled)))
        except OSError:
            pass

    def enable(self) -> None:
        """Do nothing: the cache is always on."""

    def disable(self) -> None:
        """Do nothing: the cache is always on."""

    def flush(self) -> None:
        """Do nothing: a file is replaced when its kernel is compiled again."""
