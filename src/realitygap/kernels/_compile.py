"""How every kernel is compiled: strict IEEE arithmetic, no interpreter lock, cached on disk."""

from __future__ import annotations

import functools
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


class Kernel:
    """A compiled function that can be called from Python and from other kernels.

    For other kernels it is compiled without the wrapper that Python needs, which costs a quarter of the time
    of compiling a whole run, and is not kept on disk by itself: it is part of what calls it. For Python it is
    compiled apart, at the first call, and kept.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._entry = numba.njit(**OPTIONS)(function)
        if CACHE_FOLDER is not None:
            before = numba.config.CACHE_DIR
            numba.config.CACHE_DIR = str(CACHE_FOLDER)
            try:
                self._entry._cache = _ForgivingCache(function)
            finally:
                numba.config.CACHE_DIR = before
        # Python must never call it: without a wrapper that ends the process. Numba's type holds it weakly.
        self._inner = numba.njit(**OPTIONS, no_cpython_wrapper=True)(function)
        self._numba_type_ = numba.types.Dispatcher(self._inner)

    def __call__(self, *arguments: Any) -> Any:
        return self._entry(*arguments)

    @property
    def stats(self) -> Any:
        """Numba's counts of what was loaded from disk and what was compiled."""
        return self._entry.stats


def kernel(function: F) -> F:
    """Compile `function` at its first call; a plain function where Numba is switched off."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function)  # type: ignore[return-value]
