"""Readings that are counts of pulses, as a Fluke makes them.

A Fluke 2 sends ten pulses of infrared light and counts those that it sees come back; a reading is one of 0, 1/10,
..., 1 (robots/scribbler-protocol.md, section 7.2). Light that is not sent is not seen, so the error has one side: the
count is what the response says, rounded, less the pulses that were missed. Misses come in bursts: with the
probability `burst` all pulses of a reading share one fate, which makes that the correlation of any two of them.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, stage
from realitygap.kernels.math.elementary import exp2
from realitygap.kernels.math.lanes import LANES


@inlined
def pulse_words(pulses):
    """Return the number of random words of a reading of `pulses` pulses: one for the burst, half a word a pulse."""
    return 1 + ((pulses + 1) >> 1)


@inlined
def _half(word, upper, like):
    """A number in (0, 1) from half a word, centered."""
    real = type(like)
    bits = np.int32((word >> np.uint32(16)) if upper else (word & np.uint32(0xFFFF)))
    return (real(bits) + real(0.5)) * real(1.0 / 65536.0)


@stage
def _expect(near, pulses, miss, miss_rate, expected, missing, reading):
    real = reading.dtype.type
    most, at = miss[0], miss[1]
    for lane in range(LANES):
        missing[lane] = most[lane] / (real(1.0) + exp2((at[lane] - near[lane]) * miss_rate[lane]))
        one = reading[lane]
        one = one if one < real(1.0) else real(1.0)
        one = one if one > real(0.0) else real(0.0)
        expected[lane] = np.floor(one * real(pulses) + real(0.5))
        reading[lane] = real(0.0)


@stage
def _count(pulse, word, upper, first, burst_word, burst, expected, missing, reading):
    real = reading.dtype.type
    for lane in range(LANES):
        shared = real(np.int32(burst_word[lane] >> np.uint32(9))) * real(1.0 / (1 << 23)) < burst[lane]
        own = _half(word[lane], upper, missing[lane])
        common = _half(first[lane], False, missing[lane])
        fate = common if shared else own
        seen = (fate >= missing[lane]) & (real(pulse) < expected[lane])
        reading[lane] = reading[lane] + (real(1.0) if seen else real(0.0))


@stage
def count_pulses(near, pulses, words, miss, miss_rate, burst, expected, missing, reading):
    """The share of pulses seen.

    Args:
        near: (LANES,) d, distance to what is nearest [m].
        pulses: How many are sent.
        words: (`pulse_words`, LANES) random.
        miss: (2, LANES) most and at [m]: a pulse is missed with the probability most / (1 + e^((at - d) / width)),
            to 16 bits.
        miss_rate: log2(e) / width [1/m].
        burst: Correlation between pulses of one reading, 0..1.
        expected, missing: Room.
        reading: Changed: from the response to the share of pulses.
    """
    real = reading.dtype.type
    _expect(near, pulses, miss, miss_rate, expected, missing, reading)
    for pulse in range(pulses):
        word = words[1 + (pulse >> 1)]
        if pulse & 1:
            _count(pulse, word, True, words[1], words[0], burst, expected, missing, reading)
        else:
            _count(pulse, word, False, words[1], words[0], burst, expected, missing, reading)
    for lane in range(LANES):
        reading[lane] = reading[lane] * real(1.0 / pulses)
