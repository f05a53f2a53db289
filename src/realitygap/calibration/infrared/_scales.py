"""The parameters of a range sensor's fit: what is thought possible of each, and on which scale."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from realitygap.world import RangeSensor

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """One parameter between two limits.

    Attributes:
        name: Name, the same as in a robot's file.
        low, high: Limits of the prior.
        kind: even: each value is as likely before anything was recorded; ratio: each ratio is.
        unit: Unit of its values.
        advice: Data to record if it is not identified.
    """

    name: str
    low: float
    high: float
    kind: Literal["even", "ratio"]
    unit: str
    advice: str

    def of(self, unit: Array) -> Array:
        """Return values for places in 0..1."""
        if self.kind == "ratio":
            return np.asarray(self.low * (self.high / self.low) ** unit)
        return np.asarray(self.low + (self.high - self.low) * unit)

    def place(self, value: Array | float) -> Array:
        """Return places in 0..1 of values."""
        if self.kind == "ratio":
            return np.asarray(np.log(np.asarray(value) / self.low) / np.log(self.high / self.low))
        return np.asarray((np.asarray(value) - self.low) / (self.high - self.low))

    def center(self, values: Array) -> float:
        """Return the center of samples.

        A decay is averaged as 1 / L: with log A it makes the readings' logarithms straight lines, so that the average
        of draws that agree with what was read agrees with it, too.
        """
        if self.name == "decay":
            return float(1 / np.mean(1 / values))
        return float(np.exp(np.mean(np.log(values)))) if self.kind == "ratio" else float(np.mean(values))


REACH = 0.5
"""The reach that the scales below are for [m]; `scaled` makes them those of another sensor."""

ROOM = 10.0
"""Factor around a sensor's own amplitude, decay and incidence that is thought possible at least."""

_FAR = "Record nearer to the distance from which readings fall to 0, and beyond it."

AMPLITUDE = Scale(
    "amplitude", 0.2, 10.0, "ratio", "", "Record at more distances at which readings are between 0 and full."
)
DECAY = Scale("decay", 0.03, 0.8, "ratio", "m", AMPLITUDE.advice)
GAIN = Scale("noise_gain", 0.002, 0.5, "ratio", "", AMPLITUDE.advice)
DROP = (
    Scale("drop_most", 0.0, 1.0, "even", "", "Record at larger distances at which something is still seen."),
    Scale("drop_at", 0.02, 0.6, "even", "m", _FAR),
    Scale("drop_width", 0.005, 0.15, "ratio", "m", _FAR),
)
OUTLIER = (
    Scale("outlier_most", 0.0, 1.0, "even", "", "Record at larger distances."),
    Scale("outlier_at", 0.02, 0.6, "even", "m", _FAR),
    Scale("outlier_width", 0.005, 0.15, "ratio", "m", _FAR),
)
BURST = Scale(
    "burst",
    0.0,
    1.0,
    "even",
    "",
    "Record at distances where some pulses return and some are missed: 4 to 12 in.",
)
INCIDENCE = Scale("incidence", 0.0, 4.0, "even", "", "Record near walls that are not faced.")
BATTERY = Scale(
    "battery_per_v",
    -1.0,
    1.0,
    "even",
    "1/V",
    "Record with a full and with a nearly empty battery: its voltage did not vary, or is unknown.",
)
"""Change of the logarithm of the amplitude with each volt."""


def scaled(scale: Scale, sensor: RangeSensor) -> Scale:
    """Return a scale for a sensor: lengths relative to its reach, and with room around the number that its file has."""
    size = sensor.reach / REACH if scale.unit == "m" else 1.0
    low, high = scale.low * size, scale.high * size
    if scale.name in ("amplitude", "decay"):
        own = getattr(sensor, scale.name)
        low, high = min(low, own / ROOM) if own else low, max(high, own * ROOM)
    if scale.name == "incidence":
        high = max(high, 2 * sensor.incidence)
    return replace(scale, low=low, high=high)


def column(scales: tuple[Scale, ...], values: Array, scale: Scale, own: float = 0.0) -> Array:
    """Return the values of one parameter, (m,), among those of all, (m, d), or the sensor's own number."""
    names = [candidate.name for candidate in scales]
    return values[:, names.index(scale.name)] if scale.name in names else np.full(len(values), own)
