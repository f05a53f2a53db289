"""Random numbers as a pure function of a key and a counter: Philox4x32-10.

Source: Salmon, Moraes, Dror & Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011.

The 64-bit key comes from the seed of the study and the name of the condition. The counter says which number
is meant, so that no order of execution, no thread and no interruption can change it:

    word 0  block: which group of four numbers (in a trial: the step)
    word 1  individual (24 bits) and purpose (8 bits)
    word 2  generation (20 bits) and repeat (12 bits)
    word 3  replicate
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, kernel

PURPOSE_NOISE = np.int64(1)  # sensor noise of a trial
PURPOSE_GENOME = np.int64(2)  # the first genomes
PURPOSE_CHILD = np.int64(3)  # making one child: parents, crossover, mutation
PURPOSE_SPECIES = np.int64(4)  # representatives of species; the individual is the species' place in the list

PURPOSE_MODEL = np.int64(5)  # numbers of a robot or an arena that are drawn
PURPOSE_DRIVE = np.int64(6)  # motion of `sim`: travel, heading, delay
PURPOSE_RANGE = np.int64(
    7
)  # range sensors of `sim`, beside the paper's noise, which is PURPOSE_NOISE there too
PURPOSE_PULSES = np.int64(8)  # pulses that a range sensor misses
PURPOSE_LIGHT = np.int64(9)
PURPOSE_LINE = np.int64(10)
PURPOSE_ENCODER = np.int64(11)
PURPOSE_TEAM = np.int64(12)  # who is tried together with whom

FIRST = np.int64(0)  # the first repeat, generation or row: a literal 0 would have every kernel compiled twice

MAX_INDIVIDUALS = 1 << 24
MAX_GENERATIONS = 1 << 20
MAX_REPEATS = 1 << 12

_M0 = np.uint64(0xD2511F53)
_M1 = np.uint64(0xCD9E8D57)
_W0 = np.uint64(0x9E3779B9)
_W1 = np.uint64(0xBB67AE85)
_LOW = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)
_TO_UNIT = 1.0 / 4294967296.0


@inlined
def philox(c0, c1, c2, c3, k0, k1):
    """Four 32-bit words from a counter of four words and a key of two, all uint32."""
    # Words of 64 bits, of which the lower 32 count: what is above them costs nothing until the end.
    c0, c1, c2, c3 = np.uint64(c0), np.uint64(c1), np.uint64(c2), np.uint64(c3)
    k0, k1 = np.uint64(k0), np.uint64(k1)
    for _ in range(10):
        p0 = _M0 * (c0 & _LOW)
        p1 = _M1 * (c2 & _LOW)
        c0 = (p1 >> _32) ^ c1 ^ k0
        c1 = p1
        c2 = (p0 >> _32) ^ c3 ^ k1
        c3 = p0
        k0 += _W0
        k1 += _W1
    return np.uint32(c0 & _LOW), np.uint32(c1 & _LOW), np.uint32(c2 & _LOW), np.uint32(c3 & _LOW)


@inlined
def draw_words(stream, block):
    """Words number 4 * block to 4 * block + 3 of a stream."""
    return philox(np.uint32(block), stream[0], stream[1], stream[2], stream[3], stream[4])


@inlined
def make_stream(key, replicate, generation, individual, repeat, purpose):
    """The three fixed counter words and two key words that name one stream of numbers."""
    return (
        np.uint32((np.uint64(individual) << np.uint64(8)) | np.uint64(purpose)),
        np.uint32((np.uint64(generation) << np.uint64(12)) | np.uint64(repeat)),
        np.uint32(replicate),
        np.uint32(np.uint64(key) & _LOW),
        np.uint32(np.uint64(key) >> _32),
    )


@inlined
def unit(word):
    """A float64 in (0, 1), centered: the mean over all words is exactly one half."""
    return (np.float64(word) + 0.5) * _TO_UNIT


@kernel
def draw_units(block, key, counters, units):
    """One number for each counter.

    Args:
        block: uint32, which number of the robot or arena is meant.
        key: uint64, of the random numbers.
        counters: (n, 3) uint32, the other words of each counter.
        units: (n,) float64, written: 0 < u < 1, each multiple of 2^-32 and a half as likely.
    """
    k0 = np.uint32(np.uint64(key) & np.uint64(0xFFFFFFFF))
    k1 = np.uint32(np.uint64(key) >> np.uint64(32))
    for row in range(units.size):
        words = philox(np.uint32(block), counters[row, 0], counters[row, 1], counters[row, 2], k0, k1)
        units[row] = unit(words[0])
