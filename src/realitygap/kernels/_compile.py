"""How every kernel is compiled: strict IEEE arithmetic, no interpreter lock, cached on disk."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import caching

F = TypeVar("F", bound=Callable[..., Any])

# No fastmath: results must not depend on the machine. Nobody calls kernels from C.
OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def _sources_hash() -> str:
    """A hash of all kernel sources.

    Numba's own cache looks at the file of the function alone, so an edit of a kernel in another file would
    go unseen by its callers.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_root() -> Path:
    """The folder for compiled kernels: `REALITYGAP_CACHE`, or the user's cache folder."""
    named = os.environ.get("REALITYGAP_CACHE")
    if named:
        return Path(named)
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "realitygap"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "realitygap"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "realitygap"


def _writable_cache() -> Path | None:
    """The cache folder of exactly these sources, or None (said once) where nothing can be written."""
    folder = cache_root() / f"kernels-{_sources_hash()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        warnings.warn(
            f"Compiled kernels cannot be kept in {folder} ({error.strerror}): each start compiles anew. "
            "Set REALITYGAP_CACHE to a folder that can be written.",
            RuntimeWarning,
            stacklevel=2,
        )
        return None
    return folder


CACHE_FOLDER = _writable_cache()


class _ForgivingCache(caching.FunctionCache):
    """Numba's cache, for which a torn file or a full disk means compiling again rather than an exception."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # unpickling a torn file can raise anything
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except Exception:  # a torn index is met here too; the kernel itself works
            self.flush()


def kernel(function: F) -> F:
    """Compile `function` at its first call; keep the result on disk for the next start."""
    dispatcher = numba.njit(**OPTIONS)(function)
    if CACHE_FOLDER is not None and not numba.config.DISABLE_JIT:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(CACHE_FOLDER)
        try:
            dispatcher._cache = _ForgivingCache(dispatcher.py_func)
        finally:
            numba.config.CACHE_DIR = before
    return dispatcher  # type: ignore[no-any-return]
