"""The six cells that feed robot and Fluke: they drain, and sag when the motors pull."""

from __future__ import annotations

from collections.abc import Callable

from realitygap.emulator import SECOND

FULL_VOLTS, EMPTY_VOLTS = 9.0, 6.0  # a full set; the Fluke blinks below 6.15 V
CAPACITY_AS = 2.0 * 3600  # of fresh AA cells [A s]; chosen
IDLE_A, MOTORS_A = 0.15, 0.35  # chosen
OWN_SAG = 0.015  # share of the voltage that fresh cells lose under full load; chosen
DROP_OUT_VOLTS = 5.5  # below it Bluetooth drops out; chosen


class Battery:
    """A battery with its remaining charge and its voltage under load.

    Args:
        sag: Share of the voltage lost under full load, of weak cells.
        own_volts: Function of a load of 0 to 1 that returns the voltage of a robot with its own battery [V].
    """

    def __init__(self, sag: float = 0.0, own_volts: Callable[[float], float] | None = None) -> None:
        self._sag = sag + (OWN_SAG if own_volts is None else 0.0)
        self._own_volts = own_volts
        self.used = 0.0  # share of the capacity

    def drain(self, load: float, duration_ns: int) -> None:
        """Use what robot and motors take in a while, with the motors at a load of 0 to 1."""
        amperes = IDLE_A + MOTORS_A * load
        self.used = min(1.0, self.used + amperes * duration_ns / SECOND / CAPACITY_AS)

    def volts(self, load: float) -> float:
        """Return the voltage with the motors at a load of 0 to 1."""
        if self._own_volts is not None:
            return self._own_volts(load) * (1 - self._sag * load)
        resting = FULL_VOLTS - (FULL_VOLTS - EMPTY_VOLTS) * self.used
        return resting * (1 - self._sag * load)
