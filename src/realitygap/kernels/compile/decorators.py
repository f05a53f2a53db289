"""Compile kernels: strict IEEE arithmetic, no interpreter lock, cached on disk."""

from __future__ import annotations

import functools
import os
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import numba

from .cache import PLAIN_WAY, SealedCache, usable_folder

try:
    from . import pipeline
except (ImportError, AttributeError):  # a Numba whose parts have other names
    pipeline = None

F = TypeVar("F", bound=Callable[..., Any])

# No fastmath: results must not depend on the machine. Nobody calls kernels from C.
MAKER = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


CACHE_FOLDER = usable_folder()

# Set to 1, kernels are compiled by Numba's own pipeline alone: the same results, in twice the time.
PLAIN = "REALITYGAP_PLAIN_NUMBA"

# Versions with which tests of our pipeline have passed.
KNOWN_NUMBAS = {"0.63", "0.68"}

_is_plain = pipeline is None or os.environ.get(PLAIN) == "1"


# What makes no array needs no counting of who holds which, which costs more than the work of a small kernel.
KERNEL = {**MAKER, "_nrt": False}
INLINED = {**KERNEL, "forceinline": True}


def _save_on_disk(dispatcher: Any, way: str) -> None:
    if CACHE_FOLDER is not None:
        dispatcher._cache = SealedCache(dispatcher.py_func, CACHE_FOLDER, way)


def _forward(function: Callable[..., Any], target: Kernel) -> Callable[..., Any]:
    """Return a function of the same name and arguments that calls `target`."""
    code = function.__code__
    names = ", ".join(code.co_varnames[: code.co_argcount])
    space = {"__name__": function.__module__, "_target": target}
    exec(f"def {function.__name__}({names}):\n    return _target({names})\n", space)
    forward: Callable[..., Any] = space[function.__name__]
    forward.__qualname__ = function.__qualname__
    return forward


class Kernel:
    """A compiled function that can be called from Python and from other kernels.

    For other kernels it is compiled without the wrapper that Python needs, which costs a quarter of the time
    of compiling a whole run, and is not kept on disk by itself: it is part of what calls it. For Python it is
    compiled apart, at the first call, and kept.

    A Numba that cannot take the faster way of `pipeline` compiles in its own.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        options: dict[str, Any],
        *,
        stage: bool = False,
        shared: bool = False,
        unroll: bool = False,
    ) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._options = options
        if pipeline is not None:
            # Python must never call it: without a wrapper that ends the process. Numba's type holds it weakly.
            self._inner = numba.njit(**options, no_cpython_wrapper=True)(function)
            if shared and CACHE_FOLDER is not None:
                cache = SealedCache(function, CACHE_FOLDER, "shared")
                pipeline.share(self._inner, cache, stage=stage, unroll=unroll)
                self._entry = numba.njit(**options)(_forward(function, self))
            else:
                pipeline.shorten(self._inner, inner=True, stage=stage)
                self._entry = numba.njit(**options)(function)
            pipeline.shorten(self._entry, inner=False, stage=stage)
            _save_on_disk(self._entry, "")

    @functools.cached_property
    def _plain_entry(self) -> Any:
        entry = numba.njit(**self._options)(self.py_func)
        _save_on_disk(entry, PLAIN_WAY)
        return entry

    @functools.cached_property
    def _plain_inner(self) -> Any:
        # Apart from the other one: what comes from disk cannot become part of another kernel.
        return numba.njit(**self._options)(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        return numba.types.Dispatcher(self._plain_inner if _is_plain else self._inner)

    def __call__(self, *arguments: Any) -> Any:
        """Call the function from Python, compiled at the first call with arguments of these types."""
        if _is_plain:
            return self._plain_entry(*arguments)
        try:
            return self._entry(*arguments)
        except Exception as error:  # kernels raise none: it came while compiling
            return self._call_plainly(arguments, error)

    def _call_plainly(self, arguments: Any, error: Exception) -> Any:
        """Have Numba's own pipeline compile, here and from now on, unless it finds fault as well.

        Raises:
            Exception: The `error`, if this Numba is known: then the fault is that of our pipeline or of the kernel.
        """
        global _is_plain
        if numba.__version__.rpartition(".")[0] in KNOWN_NUMBAS:
            error.add_note(f"If Numba's own pipeline compiles this kernel, set {PLAIN}=1.")
            raise error
        _is_plain = True
        try:
            result = self._plain_entry(*arguments)
        except Exception:
            _is_plain = False
            raise
        warnings.warn(
            f"Numba {numba.__version__} compiles in another way than expected ({type(error).__name__}: {error}). "
            "Kernels are compiled in its own way, which takes longer.",
            RuntimeWarning,
            stacklevel=3,
        )
        return result

    @property
    def stats(self) -> Any:
        """Numba's counts of what was loaded from disk and what was compiled."""
        return (self._plain_entry if _is_plain else self._entry).stats


def maker(function: F) -> F:
    """Compile `function`, which makes arrays or calls one that does, at its first call.

    This and the other decorators leave a plain function where Numba is switched off.
    """
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, MAKER)


def kernel(function: F) -> F:
    """Compile `function`, which makes no arrays, at its first call."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, KERNEL)


def shared(function: F) -> F:
    """Compile `function`, which makes no arrays, once for all kernels that call it: it becomes part of none."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, KERNEL, shared=True)


def shared_lanes(function: F) -> F:
    """A `shared` kernel most of whose work is in loops over lanes, which are worth unrolling."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, KERNEL, shared=True, unroll=True)


def shared_stage(function: F) -> F:
    """A `shared` kernel whose arrays must not overlap, as those of a `stage`."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, KERNEL, stage=True, shared=True, unroll=True)


def inlined(function: F) -> F:
    """A small kernel that becomes part of each of its callers, loops over lanes among them."""
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, INLINED)


def stage(function: F) -> F:
    """A kernel of loops over lanes. Its arrays must not overlap, and it must not make any.

    To be taken side by side a loop must read what it selects from before it selects: of
    `a[l] if hit else b[l]` the compiler makes one load from either address, lane by lane.
    """
    if numba.config.DISABLE_JIT:
        return function
    return Kernel(function, INLINED, stage=True)
