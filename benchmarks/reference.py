"""A fixed amount of pure Python: the unit in which processor seconds of different machines and loads compare."""

from __future__ import annotations

import sys
import time

N_STEPS = 20_000_000


def loop_seconds() -> float:
    """Return the processor seconds [s] that 20 million steps of a pseudo-random sequence take."""
    started = time.process_time()
    value = 1
    for _ in range(N_STEPS):
        value = value * 48271 % 2147483647
    seconds = time.process_time() - started
    # From value 1, whatever the machine.
    if value != pow(48271, N_STEPS, 2147483647):
        raise ArithmeticError("The loop came to another value, so its time does not count.")
    return seconds


if __name__ == "__main__":
    print(f"{loop_seconds():.3f}")
    sys.exit(0)
