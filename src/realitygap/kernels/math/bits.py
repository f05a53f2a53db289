"""Shifts and places of the bits of 32-bit words, which Numba would widen to 64; powers of two from their bits."""

from __future__ import annotations

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

SQRT_HALF = 0.70710678118654757  # rounded up in both precisions

if numba.config.DISABLE_JIT:

    def shift_left(word, places):
        """A uint32 shifted left by 0 to 31 places."""
        return np.uint32((int(word) << int(places)) & 0xFFFFFFFF)

    def lowest_bit(word):
        """The place, 0 to 31, of the lowest bit that is set in a uint32, at least one of which is."""
        return (int(word) & -int(word)).bit_length() - 1

    def highest_bit(word):
        """The place of the highest bit, likewise."""
        return int(word).bit_length() - 1

    def count_bits(word):
        """Return the number of bits set in an int32 that is not below zero."""
        return int(word).bit_count()

    def power_of_two(exponent):
        """2 to a whole number, -126 to 127 (in double precision -1022 to 1023), in the precision of that number."""
        return type(exponent)(2.0 ** int(exponent))

    def is_single(number):
        """Whether a number is of single precision: known when compiled."""
        return isinstance(number, np.float32)

    def split(number):
        """(m, k) with number = m * 2^k and sqrt(1/2) <= m < sqrt(2), of a normal number above zero, as numbers."""
        real = type(number)
        part, places = np.frexp(number)
        low = part < real(SQRT_HALF)
        return (part * real(2.0), real(places - 1)) if low else (part, real(places))

    def unmasked(number):
        """A number that a loop over lanes loads, and stores again in lanes where it does not change."""
        return number

else:

    @intrinsic
    def shift_left(context, word, places):
        """A uint32 shifted left by 0 to 31 places."""

        def generate(context, builder, signature, arguments):
            return builder.shl(*arguments)

        return types.uint32(types.uint32, types.uint32), generate

    @intrinsic
    def lowest_bit(context, word):
        """The place, 0 to 31, of the lowest bit that is set in a uint32, at least one of which is."""

        def generate(context, builder, signature, arguments):
            place = builder.cttz(arguments[0], ir.IntType(1)(1))
            return builder.zext(place, ir.IntType(64))

        return types.int64(types.uint32), generate

    @intrinsic
    def highest_bit(context, word):
        """The place of the highest bit, likewise."""

        def generate(context, builder, signature, arguments):
            place = builder.sub(ir.IntType(32)(31), builder.ctlz(arguments[0], ir.IntType(1)(1)))
            return builder.zext(place, ir.IntType(64))

        return types.int64(types.uint32), generate

    @intrinsic
    def count_bits(context, word):
        """Return the number of bits set in an int32 that is not below zero."""

        def generate(context, builder, signature, arguments):
            return builder.zext(builder.ctpop(arguments[0]), ir.IntType(64))

        return types.int64(types.int32), generate

    @intrinsic
    def power_of_two(context, exponent):
        """2 to a whole number, -126 to 127 (in double precision -1022 to 1023), in the precision of that number."""
        word, digits = (ir.IntType(32), 23) if exponent == types.float32 else (ir.IntType(64), 52)
        bias = (1 << (word.width - digits - 2)) - 1

        def generate(context, builder, signature, arguments):
            biased = builder.add(builder.fptosi(arguments[0], word), word(bias))
            return builder.bitcast(builder.shl(biased, word(digits)), arguments[0].type)

        return exponent(exponent), generate

    @intrinsic
    def is_single(context, number):
        """Whether a number is of single precision: known when compiled."""

        def generate(context, builder, signature, arguments):
            return ir.IntType(1)(signature.args[0] == types.float32)

        return types.boolean(number), generate

    @intrinsic
    def split(context, number):
        """(m, k) with number = m * 2^k and sqrt(1/2) <= m < sqrt(2), of a normal number above zero, as numbers."""
        single = number == types.float32
        word, digits = (ir.IntType(32), 23) if single else (ir.IntType(64), 52)
        least = (
            int(np.float32(SQRT_HALF).view(np.int32)) if single else int(np.float64(SQRT_HALF).view(np.int64))
        )

        def generate(context, builder, signature, arguments):
            bits = builder.bitcast(arguments[0], word)
            places = builder.ashr(builder.sub(bits, word(least)), word(digits))
            part = builder.bitcast(builder.sub(bits, builder.shl(places, word(digits))), arguments[0].type)
            if not single:  # from 32 bits more processors make many numbers at once
                places = builder.trunc(places, ir.IntType(32))
            pair = builder.sitofp(places, arguments[0].type)
            return context.make_tuple(builder, signature.return_type, (part, pair))

        return types.UniTuple(number, 2)(number), generate

    @intrinsic
    def unmasked(context, number):
        """A number that a loop over lanes loads, and stores again in lanes where it does not change.

        Without this, LLVM stores only the lanes that change. Processors with AVX2 take ten times as long for that, and
        what is stored so has to reach the cache before it can be loaded.
        """

        def generate(context, builder, signature, arguments):
            # The instruction changes no number. LLVM does not look through it for the load.
            frozen = ir.Instruction(builder.block, arguments[0].type, "freeze", list(arguments))
            builder._insert(frozen)
            return frozen

        return number(number), generate
