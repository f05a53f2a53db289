"""Shifts of 32-bit words, which Numba would widen to 64 bits."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic

if numba.config.DISABLE_JIT:

    def shift_left(word: Any, places: Any) -> Any:
        """A uint32 shifted left by 0 to 31 places."""
        return np.uint32((int(word) << int(places)) & 0xFFFFFFFF)

else:

    @intrinsic
    def shift_left(context, word, places):
        """A uint32 shifted left by 0 to 31 places."""

        def generate(context, builder, signature, arguments):
            return builder.shl(*arguments)

        return types.uint32(types.uint32, types.uint32), generate
