"""How fast this machine is; the measurement itself is tried as a command."""

import math

import pytest

from realitygap.study import measure_speed


@pytest.mark.parametrize("seconds", [math.nan, math.inf, -1.0, 0.0])
def test_a_time_that_never_comes_is_refused(seconds):
    """Some of them measured nothing, and one never ended."""
    with pytest.raises(ValueError, match="expected more than 0 and at most 3600"):
        measure_speed(seconds)
