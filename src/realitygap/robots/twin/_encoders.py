"""The encoders of a twin's wheels."""

from __future__ import annotations

import math

from ._model import TwinModel
from ._random import ENCODERS, numbers_for


class Encoders:
    """The encoders of one twin in one trial.

    Args:
        model: The twin.
        number: Number of the trial.
    """

    def __init__(self, model: TwinModel, number: int) -> None:
        self._encoders = model.encoders
        self._random = numbers_for(model.seed, number, ENCODERS)
        self._drawn: list[float] = []
        self._ways = [0.0, 0.0]

    def turn(self, left: float, right: float) -> tuple[float, float]:
        """Turn the wheels by these distances and return the distances that are counted [m]."""
        encoders = self._encoders
        counted = []
        for wheel, (way, gain) in enumerate(((left, encoders.gain_left), (right, encoders.gain_right))):
            more = gain * way
            if encoders.noise_per_m:
                if not self._drawn:
                    self._drawn = self._random.standard_normal(512).tolist()
                more += encoders.noise_per_m * math.sqrt(abs(way)) * self._drawn.pop()
            self._ways[wheel] += more
            counted.append(more)
        return counted[0], counted[1]

    @property
    def told(self) -> tuple[float, float]:
        """Way of the left and the right wheel since the start [m], in whole counts."""
        left, right = self._ways
        count = self._encoders.count
        return (round(left / count) * count, round(right / count) * count) if count else (left, right)
