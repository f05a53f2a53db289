"""How many cases a test runs: many when kernels are compiled, few when they run as plain Python."""

from __future__ import annotations

import numba

COMPILED = not numba.config.DISABLE_JIT


def cases(compiled: int, plain: int) -> int:
    return compiled if COMPILED else plain
