"""Measures the peak of a core: fused multiply-adds in single precision."""

from __future__ import annotations

import time
from collections.abc import Callable

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

BITS = (128, 256, 512)
"""Widths of the vectors that are tried [bits]: a core that lacks one splits it."""
CHAINS = 12
"""Sums side by side, so many that no unit waits for the result before."""
ROUNDS = 300_000


def peak_flops(seconds: float = 0.3) -> float:
    """Measure the peak of one core.

    Args:
        seconds: Time for each width of vectors; the fastest call counts.

    Returns:
        Operations a second in single precision; a fused multiply-add counts as two. Time is that of the thread.
    """
    return max(_rate(width // 32, seconds) for width in BITS)


def _rate(lanes: int, seconds: float) -> float:
    work = multiply_adds(lanes)
    work(1)
    until, fastest = time.perf_counter() + seconds, np.inf
    while time.perf_counter() < until or not np.isfinite(fastest):
        since = time.thread_time()
        work(ROUNDS)
        fastest = min(fastest, time.thread_time() - since)
    return 2.0 * lanes * CHAINS * ROUNDS / fastest


def multiply_adds(lanes: int) -> Callable[[int], float]:
    """Compile a loop of multiply-adds over vectors of `lanes` numbers.

    It sets x to a x + b, n times over, with a = n / (n + 1) and b = 1 - a, in each lane of `CHAINS` vectors. Chain k
    begins with n + k. The sum of all is returned.
    """

    @intrinsic
    def loop(context, n):
        def generate(context, builder, signature, arguments):
            return _loop(builder, arguments[0], lanes)

        return types.float32(types.int64), generate

    @numba.njit
    def work(n):
        return loop(n)

    return work


def _loop(builder: ir.IRBuilder, n: ir.Value, lanes: int) -> ir.Value:
    real, whole, index = ir.FloatType(), ir.IntType(64), ir.IntType(32)
    vector = ir.VectorType(real, lanes)
    fma = ir.Function(builder.module, ir.FunctionType(vector, [vector] * 3), f"llvm.fma.v{lanes}f32")

    def spread(value: ir.Value) -> ir.Value:
        undefined = ir.Constant(vector, ir.Undefined)
        first = builder.insert_element(undefined, value, index(0))
        return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(index, lanes), [0] * lanes))

    before = builder.block
    body, after = (builder.function.append_basic_block(name) for name in ("body", "after"))
    number, one = builder.sitofp(n, real), ir.Constant(real, 1.0)
    share = builder.fdiv(number, builder.fadd(number, one))
    factor, rest = spread(share), spread(builder.fsub(one, share))
    begins = [spread(builder.fadd(number, ir.Constant(real, float(k)))) for k in range(CHAINS)]
    builder.branch(body)

    builder.position_at_end(body)
    counted = builder.phi(whole)
    chains = [builder.phi(vector) for _ in begins]
    results = [builder.call(fma, [chain, factor, rest]) for chain in chains]
    more = builder.add(counted, whole(1))
    counted.add_incoming(whole(0), before)
    counted.add_incoming(more, body)
    for chain, begin, result in zip(chains, begins, results, strict=True):
        chain.add_incoming(begin, before)
        chain.add_incoming(result, body)
    builder.cbranch(builder.icmp_signed("<", more, n), body, after)

    builder.position_at_end(after)
    total = ir.Constant(real, 0.0)
    for result in results:
        for lane in range(lanes):
            total = builder.fadd(total, builder.extract_element(result, index(lane)))
    return total
