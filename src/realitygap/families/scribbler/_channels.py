"""The sensors of a Scribbler that a controller sees only if it asks for them: each costs a command on the wire."""

from __future__ import annotations

from collections.abc import Sequence

from ._identity import Identity
from ._odometry import Odometry
from ._senses import Senses

DARKEST = {"s1": 5000, "s2": 65_535}
"""The light reading of a dark room; an S1 reads more if there is no light at all."""
COUNT_M = 0.00025
"""Distance of a wheel for one count of an S2's encoders [m]."""
FULL_SPEED = 0.15
"""Speed of an S2's wheel at full command: 600 counts in a second [m/s]."""


class Channels(Senses, Identity, Odometry):
    """Light, line, and encoders of a robot, scaled for networks.

    | channel | with | from | to |
    |---|---|---|---|
    | light.0, .1, .2: left, center, right | a robot | 0: dark | 1: bright |
    | line.0, .1: left, right | a robot | 0: light floor | 1: dark floor |
    | encoder.0, .1: left, right wheel, as the end ahead sees it | an S2 or S3 | -1: full speed back | 1: full speed |
    """

    _selected: tuple[str, ...] = ()
    _is_turned = False
    _counted: tuple[float, int, int] | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the sensors besides range sensors."""
        if self.info.model is None:
            return ()
        encoders = ("encoder.0", "encoder.1") if self.info.model == "s2" else ()
        return ("light.0", "light.1", "light.2", "line.0", "line.1", *encoders)

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors that `observe` reads besides range sensors.

        Raises:
            RobotError: The robot does not answer which end is ahead, which encoders need.
        """
        self._selected = tuple(names)
        self._is_turned = self._has("encoder") and self.forwardness == "fluke"

    def _has(self, kind: str) -> bool:
        return any(name.startswith(f"{kind}.") for name in self._selected)

    def _read_channels(self) -> dict[str, float]:
        """Read the selected sensors, all of a kind in one command."""
        values: list[tuple[str, float]] = []
        if self._has("light"):
            darkest = DARKEST[self.info.model or "s2"]
            bright = (max(1.0 - raw / darkest, 0.0) for raw in self.light())
            values += [(f"light.{k}", value) for k, value in enumerate(bright)]
        if self._has("line"):
            values += [(f"line.{k}", float(dark)) for k, dark in enumerate(self.line())]
        if self._has("encoder"):
            values += [(f"encoder.{k}", value) for k, value in enumerate(self._wheel_speeds())]
        return {name: value for name, value in values if name in self._selected}

    def _wheel_speeds(self) -> tuple[float, float]:
        """Return the mean speeds since the last call as parts of full speed, -1..1; 0 at the first call of a trial."""
        left, right = self.encoders()
        if self._is_turned:
            left, right = -right, -left
        now = self.link.clock.now()
        time, *before = self._counted or (now, left, right)
        self._counted = now, left, right
        full = FULL_SPEED / COUNT_M * (now - time)
        if full <= 0:
            return 0.0, 0.0
        first, second = (
            min(max((count - old) / full, -1.0), 1.0)
            for count, old in zip((left, right), before, strict=True)
        )
        return first, second
