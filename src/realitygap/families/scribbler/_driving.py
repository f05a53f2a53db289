"""Functions that turn the wheels."""

from __future__ import annotations

from . import _codec as codec
from ._codec import SensorBlock
from ._device import Device, limited


class Driving(Device):
    """Wheel commands. The robot keeps its last command until the next one."""

    def motors(self, left: float, right: float) -> SensorBlock:
        """Turn the wheels, each -1 (full back) to 1 (full ahead), until the next command.

        Returns:
            The sensors from the answer to the command.

        Raises:
            ValueError: A wheel is out of range. Nothing was sent.
        """
        limited("left", left, -1.0, 1.0)
        limited("right", right, -1.0, 1.0)
        self.need_robot("motors")
        return self._set(codec.motors(left, right))

    def stop(self) -> None:
        """Stop the motors. This is safe at any moment, and if called twice."""
        if self.info.model is not None and self.link.is_open:
            self._set(codec.STOP)
