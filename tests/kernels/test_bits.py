"""Words and numbers made of bits."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.kernels._bits import power_of_two
from realitygap.kernels._compile import kernel


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
