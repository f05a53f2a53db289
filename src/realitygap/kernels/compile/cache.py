"""The cache of compiled kernels: one sealed file per kernel and signature, in a folder private to the user."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import os
import pickle
import stat
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import llvmlite.binding
import numba
from numba.core import caching, serialize
from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys

from . import addresses
from .progress import begin_compiling, end_compiling

if TYPE_CHECKING:
    from numba.core import types
    from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
    from numba.core.cpu import CPUContext

_PACKAGE = __name__.rsplit(".", 2)[0]
_FOLDER = Path(__file__).parent.parent

# They decide how everything is compiled, and what a file holds.
_COMPILER = {"compile.cache", "compile.decorators"}

# Kernels that no process has read for so long are deleted. Several versions can use a folder in turn.
UNUSED_S = 30 * 24 * 3600.0

SEAL_SIZE = hashlib.sha256().digest_size


def _source(module: str) -> Path:
    """Return the file of a module, named from the package of kernels on."""
    return _FOLDER / f"{module.replace('.', '/')}.py"


@functools.cache
def _imported(module: str, source: bytes) -> set[str]:
    """Return what a module of kernels with this source imports from the package of kernels, named from there on.

    Some names are those of functions, and not of modules.
    """
    folder = f"{_PACKAGE}.{module}".split(".")[:-1]
    imported = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom):
            parents = folder[: len(folder) + 1 - node.level] if node.level else []
            parent = ".".join([*parents, *filter(None, [node.module])])
            imported |= {parent, f"{parent}.__init__", *(f"{parent}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
    return {name.removeprefix(f"{_PACKAGE}.") for name in imported if name.startswith(f"{_PACKAGE}.")}


@functools.cache
def sources_hash(module: str) -> str:
    """Return a hash of the sources of a module of kernels, of Numba's version, and of Python's version.

    An edit of a kernel changes the machine code of its callers in other files. So the hash covers all modules
    that are imported, by one another too. Of a kernel elsewhere it covers all modules of kernels.

    Args:
        module: Full name.
    """
    digest = hashlib.sha256(f"{numba.__version__} {sys.implementation.cache_tag}".encode())
    if module.startswith(f"{_PACKAGE}."):
        missing = {module.removeprefix(f"{_PACKAGE}.")}
    else:
        files = (path.relative_to(_FOLDER).with_suffix("") for path in _FOLDER.rglob("*.py"))
        missing = {".".join(file.parts) for file in files}
    missing |= _COMPILER
    sources: dict[str, bytes] = {}
    while missing:
        found = {name: _source(name).read_bytes() for name in missing}
        sources |= found
        imported = set().union(*(_imported(*item) for item in found.items()))
        missing = {name for name in imported - set(sources) if _source(name).exists()}
    for name in sorted(sources):
        digest.update(name.encode())
        digest.update(sources[name])
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
    with contextlib.suppress(OSError):
        if path.stat().st_mtime < time.time() - UNUSED_S / 10:
            os.utime(path)
    seal, payload = content[:SEAL_SIZE], content[SEAL_SIZE:]
    if hashlib.sha256(payload).digest() != seal:
        raise ValueError(f"{path} is damaged")
    return pickle.loads(payload)


def write_sealed(path: Path, value: Any) -> None:
    """Write an object behind the SHA-256 checksum of its bytes; the file appears whole or not at all."""
    forget_unused(path.parent)
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


def _without_bitcode(compiled: CompileResult) -> tuple[Any, ...]:
    """Return what Numba would store, less what callers would link: a kernel's callers compile it for themselves.

    That was nine tenths of a file, and LLVM parsed it at each start. The names are what Numba looks for.
    """
    reduced = compiled._reduce()
    (library, kind, data), *others = reduced
    if kind != "object":
        return reduced
    names = (compiled.fndesc.llvm_func_name, compiled.fndesc.llvm_cpython_wrapper_name)
    return ((library, kind, (data[0], _symbols_only(names))), *others)


# Of the symbols of shared kernels; the rest of a symbol is the name of the file.
SHARED = "realitygap.shared."

# Marks what Numba's own pipeline compiles.
PLAIN_WAY = "plain"

# Libraries of shared kernels that other kernels can call, by symbol; what is forgotten here is unloaded.
_loaded: dict[str, Any] = {}


def shared_symbols(library: JITCodeLibrary) -> list[str]:
    """Return the symbols of shared kernels that a finished library calls."""
    functions = library._final_module.functions
    return [one.name for one in functions if one.is_declaration and one.name.startswith(SHARED)]


def load_shared(symbol: str, folder: Path, target_context: CPUContext) -> Any:
    """Return what is stored of a shared kernel, after loading it and those that it calls.

    Raises:
        OSError, ValueError: A file is missing or damaged.
    """
    key, stored = read_sealed(folder / f"{symbol.removeprefix(SHARED)}.kernel")
    if symbol not in _loaded:
        for needed in stored["needed"]:
            load_shared(needed, folder, target_context)
        codegen = addresses.codegen_for(target_context.codegen())
        library = codegen.unserialize_library((symbol, "object", (stored["code"], _symbols_only([symbol]))))
        _loaded[symbol] = library
    return key, stored


def forget_unused(folder: Path) -> None:
    """Delete the files that no process has read for `UNUSED_S`, as those of earlier versions.

    A process that would still have read one compiles that kernel again.
    """
    oldest = time.time() - UNUSED_S
    for pattern in ("*.kernel", ".writing-*"):
        for path in folder.glob(pattern):
            with contextlib.suppress(OSError):
                if path.stat().st_mtime < oldest:
                    path.unlink()


def _import_without_blas() -> None:
    """Import Numba's functions of arrays without SciPy's linear algebra, which takes a third of a second.

    Numba imports that at once to learn whether it is there. A function that needs it imports it when it is compiled.
    """
    if "numba.np.arraymath" in sys.modules:
        return
    from numba.np import linalg

    ensure = getattr(linalg, "ensure_blas", None)
    if ensure is None:  # another Numba, which may import what it wants
        return
    linalg.ensure_blas = lambda: None
    try:
        from numba.np import arraymath
    finally:
        linalg.ensure_blas = ensure
    arraymath.ensure_blas = ensure


def _symbols_only(names: Iterable[str]) -> bytes:
    symbols = "".join(f'define void @"{name}"() {{ ret void }}\n' for name in names)
    return llvmlite.binding.parse_assembly(symbols).as_bitcode()


class SealedCache(caching._Cache):
    """Numba's cache of one function. A file that is missing, damaged or not writable means compiling again."""

    def __init__(self, function: Callable[..., Any], folder: Path, way: str = "") -> None:
        self._module = function.__module__
        self._name = f"{self._module.removeprefix(f'{_PACKAGE}.')}.{function.__qualname__}"
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

    def _key(self, signature: tuple[types.Type, ...], codegen: JITCPUCodegen) -> tuple[Any, ...]:
        is_short = self._way != PLAIN_WAY and addresses.is_short(addresses.codegen_for(codegen))
        machine = (*codegen.magic_tuple(), "short" if is_short else "")
        return (self._name, self._sources, self._code, self._way, signature, machine)

    def _stem(self, key: tuple[Any, ...]) -> str:
        return f"{self._name}-{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}"

    def _path(self, key: tuple[Any, ...]) -> Path:
        return self._folder / f"{self._stem(key)}.kernel"

    def load_overload(self, signature: tuple[types.Type, ...], target_context: CPUContext) -> Any:
        """Return the compiled function, or None if it has to be compiled."""
        rtsys.initialize(target_context)  # all that machine code needs: the rest of Numba is for compiling
        key = self._key(signature, target_context.codegen())
        try:
            stored, reduced, needed = read_sealed(self._path(key))
            for symbol in needed:
                load_shared(symbol, self._folder, target_context)
        except (OSError, ValueError):
            begin_compiling(self._name)
            _import_without_blas()
            return None
        # Shortened hashes could agree by chance.
        context = target_context if self._way == PLAIN_WAY else addresses.context_of(target_context)
        return CompileResult._rebuild(context, *reduced) if stored == key else None

    def save_overload(self, signature: tuple[types.Type, ...], compiled: CompileResult) -> None:
        """Save the compiled function, unless that fails: the function works without its file."""
        end_compiling(self._name)
        key = self._key(signature, compiled.codegen)
        try:
            needed = shared_symbols(compiled.library)
            write_sealed(self._path(key), (key, _without_bitcode(compiled), needed))
        except OSError:
            pass

    def symbol(self, signature: tuple[types.Type, ...], target_context: CPUContext) -> str:
        """The symbol of a shared kernel: the same in each process that has these sources."""
        return SHARED + self._stem(self._key(signature, target_context.codegen()))

    def load_shared(
        self, signature: tuple[types.Type, ...], target_context: CPUContext
    ) -> dict[str, Any] | None:
        """Return what is stored of a shared kernel, or None if it has to be compiled."""
        rtsys.initialize(target_context)
        try:
            key, stored = load_shared(self.symbol(signature, target_context), self._folder, target_context)
        except (OSError, ValueError):
            begin_compiling(self._name)
            _import_without_blas()
            return None
        return stored if key == self._key(signature, target_context.codegen()) else None

    def save_shared(
        self,
        signature: tuple[types.Type, ...],
        target_context: CPUContext,
        library: JITCodeLibrary,
        stored: dict[str, Any],
    ) -> None:
        """Save a shared kernel, unless that fails: it works without its file."""
        end_compiling(self._name)
        key = self._key(signature, target_context.codegen())
        _loaded[self.symbol(signature, target_context)] = library
        stored |= {"code": library._get_compiled_object(), "needed": shared_symbols(library)}
        try:
            write_sealed(self._path(key), (key, stored))
        except OSError:
            pass

    def enable(self) -> None:
        """Do nothing: the cache is always on."""

    def disable(self) -> None:
        """Do nothing: the cache is always on."""

    def flush(self) -> None:
        """Do nothing: a file is replaced when its kernel is compiled again."""
