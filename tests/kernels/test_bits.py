"""Words and numbers made of bits."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.math.bits import highest_bit, lowest_bit, power_of_two


@kernel
def powers_of_two(exponents, powers):
    for k in range(exponents.size):
        powers[k] = power_of_two(exponents[k])


@pytest.mark.parametrize(("real", "most"), [(np.float32, 127), (np.float64, 1023)])
def test_powers_of_two_are_exact(real: type, most: int) -> None:
    exponents = np.arange(1 - most, most + 1).astype(real)
    powers = np.empty_like(exponents)
    powers_of_two(exponents, powers)
    assert powers.tolist() == [2.0 ** int(k) for k in exponents]


@kernel
def ends_of(words, lowest, highest):
    for k in range(words.size):
        lowest[k] = lowest_bit(words[k])
        highest[k] = highest_bit(words[k])


def test_the_lowest_and_the_highest_bit_of_a_word_are_found() -> None:
    singles = [1 << k for k in range(32)]
    pairs = [one | other for one in singles for other in singles]
    words = np.array(pairs, np.uint32)
    lowest, highest = np.empty(words.size, np.int64), np.empty(words.size, np.int64)
    ends_of(words, lowest, highest)
    assert lowest.tolist() == [f"{word:032b}"[::-1].index("1") for word in pairs]
    assert highest.tolist() == [31 - f"{word:032b}".index("1") for word in pairs]
