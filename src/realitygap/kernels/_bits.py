"""Shifts of 32-bit words, which Numba would widen to 64 bits, and powers of two from their bits."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

if numba.config.DISABLE_JIT:

    def shift_left(word: Any, places: Any) -> Any:
        """A uint32 shifted left by 0 to 31 places."""
        return np.uint32((int(word) << int(places)) & 0xFFFFFFFF)

    def power_of_two(exponent: Any) -> Any:
        """2 to a whole number, -126 to 127 (in double precision -1022 to 1023), in the precision of that number."""
        return type(exponent)(2.0 ** int(exponent))

else:

    @intrinsic
    def shift_left(context, word, places):
        """A uint32 shifted left by 0 to 31 places."""

        def generate(context, builder, signature, arguments):
            return builder.shl(*arguments)

        return types.uint32(types.uint32, types.uint32), generate

    @intrinsic
    def power_of_two(context, exponent):
        """2 to a whole number, -126 to 127 (in double precision -1022 to 1023), in the precision of that number."""
        word, digits = (ir.IntType(32), 23) if exponent == types.float32 else (ir.IntType(64), 52)
        bias = (1 << (word.width - digits - 2)) - 1

        def generate(context, builder, signature, arguments):
            biased = builder.add(builder.fptosi(arguments[0], word), word(bias))
            return builder.bitcast(builder.shl(biased, word(digits)), arguments[0].type)

        return exponent(exponent), generate
