"""Noise of range sensors: the zero-inflated mixture of infrared ones, counts of pulses, and the paper's uniform noise.

A reading is made in this order: the response; times 1 + gain * N; compressed; limited to 0..1; then with some
probability nothing (0), or else with some probability anything (uniform); then the paper's a * U added. Each draws
its own words, so that switching one off leaves the others as they are. A reading is one reading: nothing here depends
on how long a step lasts.

A Fluke 2 sends ten pulses of infrared light and counts those that it sees come back; a reading is one of 0, 1/10,
..., 1. Light that is not sent is not seen, so the error has one side: the
count is what the response says, rounded, less the pulses that were missed. Misses come in bursts: with the
probability `burst` all pulses of a reading share one fate, which makes that the correlation of any two of them.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, stage
from realitygap.kernels.math.bits import shift_left
from realitygap.kernels.math.elementary import exp2, normal
from realitygap.kernels.math.lanes import LANES

from .ranges import unit_of

PER_BLOCK = 3  # sensors that share the four words of a block


@stage
def second_word(word, spare, place, value):
    """A second random word of 21 bits for a sensor: 11 that its first one leaves, 10 of a spare one.

    Its lowest 11 bits repeat the highest, so that complements stay complements.

    Args:
        word: (LANES,) of the sensor, of which the upper 21 bits are for a choice.
        spare: The last word of the block.
        place: 0, 1 or 2: which 10 bits of it.
        value: Written.
    """
    shift = np.uint32(10 * place)
    for lane in range(LANES):
        left = np.uint32(word[lane] & np.uint32(0x7FF))
        more = np.uint32(np.uint32(spare[lane] >> shift) & np.uint32(0x3FF))
        value[lane] = np.uint32(
            shift_left(left, np.uint32(21)) | np.uint32(shift_left(more, np.uint32(11)) | left)
        )


@inlined
def _choice_of(word, like):
    """A number in (0, 1) from the upper 21 bits of a word, centered, exact in the precision of `like`."""
    real = type(like)
    return (real(np.int32(word >> np.uint32(11))) + real(0.5)) * real(1.0 / (1 << 21))


@stage
def gain_noise(word, gain, reading):
    """Times 1 + gain * N(0, 1), by a word a lane."""
    real = reading.dtype.type
    for lane in range(LANES):
        reading[lane] = reading[lane] * (real(1.0) + gain[lane] * normal(word[lane], gain[lane]))


@stage
def mixture(near, choice, value, drop, drop_rate, outlier, outlier_rate, reading):
    """Nothing, anything, or the reading, limited to 0..1.

    The probability of nothing is most / (1 + e^((at - d) / width)), that of anything the same with other numbers;
    where the two exceed 1, the first keeps its share. A width below 0 turns the rise into a fall.

    Args:
        near: (LANES,) d, distance to what is nearest [m].
        choice, value: Random words; the upper 21 bits of the first choose, the second is the outlier.
        drop, outlier: (2, LANES) most and at [m].
        drop_rate, outlier_rate: log2(e) / width [1/m].
        reading: Changed.
    """
    real = reading.dtype.type
    drop_most, drop_at = drop[0], drop[1]
    outlier_most, outlier_at = outlier[0], outlier[1]
    for lane in range(LANES):
        d = near[lane]
        u = _choice_of(choice[lane], d)
        # u < most / (1 + e), without a division
        dropped = u * (real(1.0) + exp2((drop_at[lane] - d) * drop_rate[lane])) < drop_most[lane]
        out = (real(1.0) - u) * (
            real(1.0) + exp2((outlier_at[lane] - d) * outlier_rate[lane])
        ) < outlier_most[lane]
        one = reading[lane]
        one = one if one < real(1.0) else real(1.0)
        one = one if one > real(0.0) else real(0.0)
        one = unit_of(value[lane], d) if out else one
        reading[lane] = real(0.0) if dropped else one


@stage
def uniform_noise(word, level, reading):
    """Plus level * U(-1, 1), by a word a lane: the paper's noise, to the bit as in `jyro`."""
    real = reading.dtype.type
    for lane in range(LANES):
        # Odd, from 1 - 2^24 to 2^24 - 1, which both precisions hold exactly: the mean is 0 in either.
        odd = np.int32(np.int32(word[lane] >> np.uint32(8)) * np.int32(2) + np.int32(1 - (1 << 24)))
        reading[lane] = reading[lane] + level[lane] * (real(odd) * real(1.0 / (1 << 24)))


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
