"""The wheels."""

from __future__ import annotations

from . import _codec as codec
from ._codec import SensorBlock
from ._device import Device, limited


class Driving(Device):
    """Turning the wheels. The robot keeps on doing what it was told last, until it is told something else."""

    def motors(self, left: float, right: float) -> SensorBlock:
        """Turn the wheels, each -1 (full back) to 1 (full ahead), until told otherwise.

        Returns:
            What the robot sensed as it was told.

        Raises:
            ValueError: A wheel is out of range. The robot was not told.
        """
        limited("left", left, -1.0, 1.0)
        limited("right", right, -1.0, 1.0)
        self.need_robot("motors")
        return self._set(codec.motors(left, right))

    def stop(self) -> None:
        """Stop the motors; safe to call at any moment, and twice."""
        if self.info.model is not None and self.link.is_open:
            self._set(codec.STOP)
