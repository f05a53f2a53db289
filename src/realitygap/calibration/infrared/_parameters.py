"""The parameters of a range sensor's fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from realitygap.world import RangeSensor

from .._prior import Parameter, even, ratio
from .._range_response import TABLE_DISTANCE

Array = NDArray[np.float64]

REACH = 0.5
"""The reach that the priors below are for [m]; `scaled` makes them those of another sensor."""

ROOM = 10.0
"""Factor around a sensor's own amplitude, decay and incidence that is thought possible at least."""

_BETWEEN = "Record at more distances at which readings are between 0 and full."
_FAR = "Record nearer to the distance from which readings fall to 0, and beyond it."

AMPLITUDE = Parameter("amplitude", ratio(0.2, 10.0), advice=_BETWEEN)
DECAY = Parameter("decay", ratio(0.03, 0.8), "m", advice=_BETWEEN)
HALF_WIDTH = Parameter("half_width", ratio(0.02, 0.5), "m", advice=_BETWEEN)
GAIN = Parameter("noise_gain", ratio(0.002, 0.5), advice=_BETWEEN)
NOISE = Parameter("noise_uniform", ratio(0.0002, 0.1), advice="Record more readings in one place.")
WIDE_NOISE = tuple(replace(each, prior=even(0.0, 0.5)) for each in (NOISE, GAIN))
"""Noise of a sensor that may have none: a simulated one, or one that answers 0 or 1."""
SCALE = Parameter(TABLE_DISTANCE, ratio(0.5, 2.0), advice=_BETWEEN)
FARTHEST = 2.0
"""Largest factor between the reach of a `linear` sensor and that in its robot file, up or down."""
DROP = (
    Parameter(
        "drop_most", even(0.0, 1.0), advice="Record at larger distances at which something is still seen."
    ),
    Parameter("drop_at", even(0.02, 0.6), "m", advice=_FAR),
    Parameter("drop_width", ratio(0.005, 0.15), "m", advice=_FAR),
)
OUTLIER = (
    Parameter("outlier_most", even(0.0, 1.0), advice="Record at larger distances."),
    Parameter("outlier_at", even(0.02, 0.6), "m", advice=_FAR),
    Parameter("outlier_width", ratio(0.005, 0.15), "m", advice=_FAR),
)
BURST = Parameter(
    "burst",
    even(0.0, 1.0),
    advice="Record at distances where some pulses return and some are missed: 4 to 12 in.",
)
INCIDENCE = Parameter("incidence", even(0.0, 4.0), advice="Record near walls that are not faced.")
BATTERY = Parameter(
    "battery_per_v",
    even(-1.0, 1.0),
    "1/V",
    advice="Record with a full and with a nearly empty battery: its voltage did not vary, or is unknown.",
)
"""Change of the logarithm of the amplitude with each volt."""


def scaled(parameter: Parameter, sensor: RangeSensor) -> Parameter:
    """Return a parameter of a sensor: lengths relative to its reach, and with room around the number in its file."""
    size = sensor.reach / REACH if parameter.unit == "m" else 1.0
    low, high = parameter.prior.lowest * size, parameter.prior.highest * size
    if parameter.name in ("amplitude", "decay"):
        own = getattr(sensor, parameter.name)
        low, high = min(low, own / ROOM) if own else low, max(high, own * ROOM)
    if parameter.name == "incidence":
        high = max(high, 2 * sensor.incidence)
    return replace(parameter, prior=ratio(low, high) if parameter.is_ratio else even(low, high))


def reach_of(sensor: RangeSensor) -> Parameter:
    """Return the reach of a `linear` sensor. It decides the slope of the readings, and so their scale, too."""
    return Parameter("reach", ratio(sensor.reach / FARTHEST, sensor.reach * FARTHEST), "m", advice=_BETWEEN)


def column(parameters: tuple[Parameter, ...], values: Array, parameter: Parameter, own: float = 0.0) -> Array:
    """Return the values of one parameter, (m,), among those of all, (m, d), or the sensor's own number."""
    names = [candidate.name for candidate in parameters]
    return values[:, names.index(parameter.name)] if parameter.name in names else np.full(len(values), own)
