"""The loop by which the peak of a core is measured."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.kernels.math.peak import CHAINS, multiply_adds


@pytest.mark.parametrize("lanes", [4, 16])
def test_every_lane_of_every_chain_is_computed(lanes):
    n = 7
    chains = n + np.arange(CHAINS, dtype=np.float64)
    for _ in range(n):
        chains = chains * n / (n + 1) + 1 / (n + 1)
    assert multiply_adds(lanes)(n) == pytest.approx(lanes * chains.sum(), rel=1e-5)
