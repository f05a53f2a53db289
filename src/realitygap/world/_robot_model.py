"""A robot as a file describes it: what can collide, how commands become motion, and what it senses."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap.drawing import Ink, picture_of
from realitygap.settings import Settings

from ._described import Described, NotNegative, Number, Positive, Share
from ._part import Part

MOST_SENSORS = 64  # of one kind
SAME_EVERYWHERE = math.pi  # half angle of a cone that is a full circle [rad]

HalfAngle = Annotated[NotNegative, Field(le=SAME_EVERYWHERE)]


def _without(values: dict[str, Any], unused: dict[str, float]) -> dict[str, Any]:
    """Return values without those that have their defaults."""
    return {key: value for key, value in values.items() if key not in unused or value != unused[key]}


class Contact(Settings):
    """Contact between the body and walls, obstacles, or other robots."""

    model: Literal["freeze", "stop", "slide"] = Field(
        "slide",
        description="`freeze`: a blocked robot does not move at all, as in Jyro. `stop`: it turns if its body allows, "
        "and does not slide. `slide`: it skids and turns along the obstacle.",
    )
    friction: NotNegative = Field(
        0.3, description="Friction coefficient mu between body and wall, the tangent of the friction angle."
    )
    long: Positive = Field(1.0, description="Mobility along the heading when pushed, relative to `lat`.")
    lat: Positive = Field(1.0, description="Mobility sideways when pushed, against the grip of the wheels.")
    ang: Positive = Field(
        171.0,
        description="Mobility of turns when pushed [1/m2]: 1 / r2 for a grip at distance r from the origin.",
    )
    saturation: NotNegative = Field(
        0.0,
        description="Saturation of the wheels' grip [s/m]: one over the speed of slip from which on the grip hardly "
        "grows. 0: it grows without limit.",
    )


class Drive(Settings):
    """Motion that follows from the commands move and turn in -1..1."""

    mixing: Literal["wheels", "independent"] = Field(
        "wheels",
        description="`wheels`: left = move - turn and right = move + turn, each limited to -1..1. `independent`: move "
        "and turn set separate speeds.",
    )
    ahead: Literal[1, -1] = Field(
        1, description="Direction of move = 1: 1 towards +x of the body, -1 towards its back."
    )
    levels: int = Field(
        0,
        ge=0,
        le=1000,
        description="Number of speeds up to full. The nearest one is used. 0: any speed.",
    )
    lowest_level: int = Field(0, ge=0, description="Slowest speed above 0, counted in `levels`.")
    speed: Positive = Field(description="Speed of a wheel at full command [m/s].")
    track: Positive = Field(description="Distance between the wheels' points of contact [m].")
    axle: Number = Field(0.0, description="Position of the wheels' axle ahead of the body's origin [m].")
    turn_rate: Positive = Field(1.0, description="Turn rate at full turn, with mixing independent [rad/s].")
    gain_left: Positive = Field(1.0, description="Factor of the left wheel's speed.")
    gain_right: Positive = Field(1.0, description="Factor of the right wheel's speed.")
    bias_left: Number = Field(0.0, description="Offset of the left wheel's speed while it is driven [m/s].")
    bias_right: Number = Field(0.0, description="Offset of the right wheel's speed while it is driven [m/s].")
    dead_band: Share = Field(0.0, description="Smallest command that moves a wheel.")
    lag: NotNegative = Field(0.0, description="Time constant of a wheel's approach to its new speed [s].")
    rise: NotNegative = Field(
        0.0,
        description="Time in which the faster wheel's speed rises linearly from 0 to full [s]. The rise of both wheels "
        "restarts if either reverses.",
    )
    delay: NotNegative = Field(0.0, description="Delay from the command to the wheels [s].")
    delay_jitter: NotNegative = Field(
        0.0, description="The delay of a step is delay + delay_jitter * U(-1, 1) [s]."
    )
    slip: Share = Field(0.0, description="Share of a wheel's travel that is lost.")
    travel_noise_per_m: NotNegative = Field(
        0.0,
        description="Standard deviation of the distance driven, after one meter [m]; grows with its root.",
    )
    travel_noise_per_s: NotNegative = Field(
        0.0, description="Standard deviation of the distance driven, after one second of driving [m]."
    )
    heading_noise_per_m: NotNegative = Field(
        0.0, description="Standard deviation of the heading, after one meter [rad]."
    )
    heading_noise_per_s: NotNegative = Field(
        0.0, description="Standard deviation of the heading, after one second of driving [rad]."
    )
    drift_per_m: Number = Field(0.0, description="Turn to the left in each meter driven [rad].")
    battery_sag: NotNegative = Field(
        0.0, description="Share of the speed that is lost in each second of a trial."
    )
    soft_dead_band: Share = Field(
        0.0,
        description="A wheel stands at commands u up to this share d. Beyond, its speed is (|u| - d) / (1 - d) of full "
        "speed, in both directions.",
    )

    @model_validator(mode="after")
    def _has_its_lowest_level(self) -> Self:
        if self.lowest_level > self.levels:
            raise ValueError(f"lowest_level is {self.lowest_level}, expected at most levels, {self.levels}")
        return self

    @model_serializer(mode="wrap")
    def _without_no_soft_dead_band(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out a newer number if it is not used, so that older conditions keep their hashes."""
        return _without(handler(self), {"soft_dead_band": 0.0})


class Sample(Settings):
    """Reading of a range sensor at one distance."""

    distance: NotNegative = Field(description="Distance to the obstacle [m].")
    reading: Share = Field(description="Reading, 0 (nothing) to 1 (full).")


class PointSensor(Settings):
    """A sensor at a place of the body."""

    x: Number = Field(description="Position of the sensor ahead of the body's origin [m].")
    y: Number = Field(description="Position of the sensor to the left of the body's origin [m].")


class RangeSensor(PointSensor):
    """A sensor that answers to what is near: 0 for nothing, 1 for very near."""

    direction: Number = Field(0.0, description="Direction of the sensor, positive to the left [rad].")
    cone: HalfAngle = Field(0.0, description="Half of the viewing angle [rad].")
    reach: Positive = Field(description="Range of the sensor [m].")
    rays: int = Field(
        1,
        ge=1,
        le=63,
        description="Number of rays over the cone: 1, or an odd number; with lorentz 1 or 3. Responses linear and "
        "table use the nearest ray, the others the light of all rays.",
    )
    response: Literal["linear", "ir", "table", "pulses", "lorentz"] = Field(
        "linear",
        description="`linear`: 1 - d / reach. `ir`: amplitude * exp(-d / decay). `table`: interpolated from `table`. "
        "`pulses`: the detected share of `pulses`, the reading of `ir` minus the pulses missed with the probability of "
        "drop_*. `lorentz`: amplitude * (W^2 - P^2) / (d^2 - 2 P d + W^2), with W = half_width and P = "
        "peak, and 0 beyond the reach.",
    )
    amplitude: NotNegative = Field(
        1.0, description="A of ir and pulses: the reading at no distance; of lorentz: at `peak`."
    )
    decay: Positive = Field(
        0.1, description="L of ir and pulses: the distance at which the reading has fallen to 1/e [m]."
    )
    pulses: int = Field(10, ge=1, le=1000, description="Number of pulses per reading, with response pulses.")
    table: tuple[Sample, ...] = Field(
        (),
        max_length=64,
        description="Rows [distance, reading] by increasing distance, with linear interpolation.",
    )
    noise_uniform: NotNegative = Field(0.0, description="a: a * U(-1, 1) is added, as the paper does.")
    noise_gain: NotNegative = Field(0.0, description="Standard deviation by which a reading is multiplied.")
    drop_most: Share = Field(0.0, description="Probability of a reading of 0, far away.")
    drop_at: Number = Field(0.1, description="Distance at which this is half as likely [m].")
    drop_width: Positive = Field(0.02, description="Width of the logistic curve of this probability [m].")
    outlier_most: Share = Field(0.0, description="Probability of any reading in 0..1, far away.")
    outlier_at: Number = Field(0.1, description="Distance at which this is half as likely [m].")
    outlier_width: Positive = Field(0.02, description="Width of the logistic curve of this probability [m].")
    burst: Share = Field(0.0, description="Correlation of the pulses of one reading, with response pulses.")
    incidence: NotNegative = Field(
        0.0,
        description="Value k of ir and pulses. A surface that a ray meets at an angle a to its normal reflects the "
        "share c / (c + k (1 - c)), with c = cos a. Value `0`: all; `1`: as a matt surface does (Lambert).",
    )
    half_width: Positive = Field(
        0.1, description="W of lorentz: the distance at which a reading is half of that at a peak of 0 [m]."
    )
    peak: Number = Field(
        0.0,
        description="P of lorentz: the distance at which a reading is largest [m]; nearer it stays so. Less than W.",
    )
    keeps_edge: bool = Field(
        False,
        description="True: a ray of lorentz that meets nothing adds what it would add at the reach, if another ray "
        "meets something. False: it adds nothing.",
    )
    compression: NotNegative = Field(
        0.0,
        description="c of ir: of the light x the sensor reads ln(1 + c x) / c, after noise_gain, up to 1. 0: x.",
    )

    @model_validator(mode="after")
    def _has_what_its_response_needs(self) -> Self:
        if self.rays % 2 == 0:
            raise ValueError(f"rays is {self.rays}, expected an odd number: one looks straight ahead")
        if self.response == "table" and len(self.table) < 2:
            raise ValueError(
                f"expected a table of at least 2 rows with response 'table', got {len(self.table)}"
            )
        if self.response != "table" and self.table:
            raise ValueError(
                f"response is {self.response!r}, which needs no table. Leave it out, or set 'table'"
            )
        far = [sample.distance for sample in self.table]
        if any(a >= b for a, b in pairwise(far)):
            raise ValueError("expected the table's rows by growing distance, each once")
        if self.response == "lorentz":
            self._check_lorentz()
        elif self.keeps_edge:
            raise ValueError(f"keeps_edge is true, expected false with response {self.response!r}")
        return self

    def _check_lorentz(self) -> None:
        if self.rays > 3:
            raise ValueError(f"rays is {self.rays}, expected 1 or 3 with response 'lorentz'")
        if self.rays == 3 and self.cone >= math.pi / 2:
            raise ValueError(f"cone is {self.cone:g}, expected less than pi / 2 with response 'lorentz'")
        if abs(self.peak) >= self.half_width:
            raise ValueError(
                f"peak is {self.peak:g}, expected less than half_width, {self.half_width:g}, with response 'lorentz'"
            )

    @model_serializer(mode="wrap")
    def _without_later_numbers(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out newer numbers that are not used, so that older conditions keep their hashes."""
        lorentz = {} if self.response == "lorentz" else {"half_width": 0.1, "peak": 0.0}
        return _without(handler(self), lorentz | {"keeps_edge": False, "compression": 0.0})


class LightSensor(PointSensor):
    """A sensor that answers to lights: a cosine lobe in its direction."""

    direction: Number = Field(0.0, description="Direction of the sensor, positive to the left [rad].")
    width: Annotated[Positive, Field(le=math.pi)] = Field(
        math.pi / 2, description="Half of the angle of its lobe, beyond which the reading is 0 [rad]."
    )
    gain: NotNegative = Field(1.0, description="Reading for a light of strength 1 straight ahead, 1 m away.")
    noise: NotNegative = Field(0.0, description="Standard deviation by which a reading is multiplied.")


class LineSensor(PointSensor):
    """A sensor under the robot that tells dark floor from light floor."""

    threshold: Share = Field(
        0.5, description="Brightness below which the reading is 1: 0 is black, 1 is white."
    )
    noise: NotNegative = Field(0.0, description="Standard deviation added to the brightness.")
    level: bool = Field(
        False, description="True: the reading is the darkness of the floor, instead of 0 or 1."
    )


class BumpSensor(PointSensor):
    """A switch that is closed while the body is touched near it."""

    reach: Positive = Field(description="Largest distance of a touch [m].")


class SensorKind(NamedTuple):
    """Properties that all sensors of a kind share.

    Attributes:
        ink: Color of their places in pictures.
        is_signed: True if they answer -1..1 instead of 0..1.
    """

    ink: str
    is_signed: bool = False


SENSORS = {
    "range": SensorKind(Ink.PUBLISHED),
    "light": SensorKind(Ink.PEN5),
    "line": SensorKind(Ink.PEN3),
    "bump": SensorKind(Ink.PEN4),
}
"""Kinds of sensors with a place on the body. A kind has one name everywhere: its field of `RobotModel`, its inputs, and
its numbers in `kernels.sim.shape.SENSOR_NUMBERS`, which have the same order."""


class Encoders(Settings):
    """Encoders of the wheels."""

    gain_left: Positive = Field(1.0, description="Distance reported for each meter of the left wheel.")
    gain_right: Positive = Field(1.0, description="Distance reported for each meter of the right wheel.")
    noise_per_m: NotNegative = Field(
        0.0, description="Standard deviation after one meter [m]. It grows with the root of the distance."
    )
    drift_per_m: Number = Field(
        0.0, description="False turn to the left, as reported for each meter driven [rad]."
    )


class Stall(Settings):
    """Detection of stalls."""

    kind: Literal["blocked", "idler"] = Field(
        "blocked",
        description="`blocked`: any obstacle in this step. `idler`: as in an S2, a third wheel that turns too little "
        "for the turns of the drive wheels.",
    )
    idler: Number = Field(0.0, description="Position of the third wheel ahead of the body's origin [m].")
    share: Share = Field(
        0.5, description="Share of the drive wheels' distance below which the robot is stalled."
    )
    window: NotNegative = Field(1.6, description="Time over which both distances are averaged [s].")


class Looks(Settings):
    """Details that only drawings use."""

    wheel_diameter: float = Field(0.0, ge=0, description="Diameter of the wheels [m]; 0 to draw none.")
    wheel_width: float = Field(0.0, ge=0, description="Width of the wheels [m].")
    pen: tuple[float, float] | None = Field(None, description="Position of the pen, x and y [m].")
    caster: tuple[float, float] | None = Field(
        None, description="Point at which the third support touches the floor [m]."
    )


class RobotModel(Described):
    """A robot: structure, and numbers that have dotted names and may be distributions.

    Frame: x ahead, y to the left, origin midway between the wheels unless `drive.axle` says otherwise.

    Raises:
        ValueError: A value is unknown, missing or out of its range; every mistake with its place.
    """

    name: str = Field(min_length=1, max_length=80, description="Name of the robot.")
    description: str = Field("", max_length=2000, description="Description of the robot in one sentence.")
    sources: tuple[str, ...] = Field((), description="Sources of the numbers.")
    step_s: float = Field(0.1, gt=0, le=60, description="Duration of a command [s]. A study may change it.")
    body: tuple[Part, ...] = Field(
        min_length=1,
        max_length=16,
        description="Outline that can collide: one convex part, or several fixed to each other.",
    )
    contact: Contact = Contact()
    drive: Drive
    range: tuple[RangeSensor, ...] = Field((), max_length=MOST_SENSORS, description="Range sensors.")
    light: tuple[LightSensor, ...] = Field((), max_length=MOST_SENSORS, description="Light sensors.")
    line: tuple[LineSensor, ...] = Field((), max_length=MOST_SENSORS, description="Line sensors.")
    bump: tuple[BumpSensor, ...] = Field((), max_length=MOST_SENSORS, description="Bump sensors.")
    encoder: Encoders | None = Field(None, description="Encoders of the wheels, if the robot has any.")
    stall: Stall = Stall()
    shadows: Literal["none", "half", "dark"] = Field(
        "dark",
        description="Light behind walls and obstacles: all, half as in Jyro, or nothing.",
    )
    looks: Looks = Looks()
    driver: dict[str, Any] = Field(
        {},
        description="Settings of the driver of the robot's family, such as topics. Simulators do not use them.",
    )

    def to_dict(self) -> dict[str, Any]:
        """Return the robot as plain values without what decides nothing in a simulation; `from_dict` makes it again."""
        unused = ("description", "sources", "driver")
        return {key: value for key, value in super().to_dict().items() if key not in unused}

    def _repr_svg_(self) -> str:
        return picture_of(self).to_svg()

    @property
    def sensors(self) -> dict[str, tuple[PointSensor, ...]]:
        """Sensors with a place on the body, by their kind in `SENSORS`."""
        return {kind: getattr(self, kind) for kind in SENSORS}

    @property
    def mounts(self) -> tuple[tuple[float, float, float], ...]:
        """(s, 3) forward [m], left [m] and direction [rad] of each range sensor."""
        return tuple((sensor.x, sensor.y, sensor.direction) for sensor in self.range)

    @property
    def reach(self) -> float:
        """The longest reach of a range sensor [m]; 0 without one."""
        return max((sensor.reach for sensor in self.range), default=0.0)

    @property
    def radius(self) -> float:
        """The largest distance from the origin to a point of the body [m]."""
        return max(math.hypot(x, y) + part.radius for part in self.body for x, y in part.corners)
