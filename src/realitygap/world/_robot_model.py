"""A robot as a file describes it: what can collide, how commands become motion, and what it senses."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap.drawing import picture_of
from realitygap.settings import Settings

from ._numbers import Described, NotNegative, Number, Positive, Share
from ._part import Part

MOST_SENSORS = 64  # of one kind
SAME_EVERYWHERE = math.pi  # half angle of a cone that is a full circle [rad]

HalfAngle = Annotated[NotNegative, Field(le=SAME_EVERYWHERE)]


def _without(values: dict[str, Any], unused: dict[str, float]) -> dict[str, Any]:
    """Return values without those that are as if nobody had said anything."""
    return {key: value for key, value in values.items() if key not in unused or value != unused[key]}


class Contact(Settings):
    """What happens where the body meets something."""

    model: Literal["freeze", "stop", "slide"] = Field(
        "slide",
        description="freeze: a blocked robot does not move at all, as in Jyro; stop: it turns where its body allows, "
        "and does not slide; slide: it skids and turns along what it meets.",
    )
    friction: NotNegative = Field(
        0.3, description="Between body and wall: mu, the tangent of the friction angle."
    )
    long: Positive = Field(1.0, description="How easily it is pushed along its heading, against `lat`.")
    lat: Positive = Field(1.0, description="How easily it is pushed sideways: against its wheels' grip.")
    ang: Positive = Field(
        171.0,
        description="How easily it is turned [1/m2]: 1 / r2, as if its grip on the floor lay r from its origin.",
    )
    saturation: NotNegative = Field(
        0.0,
        description="How soon the wheels' grip gives out [s/m]: one over the speed of slip from which on it hardly "
        "grows; 0 where it grows without end.",
    )


class Drive(Settings):
    """How commands, move and turn in -1..1, become motion."""

    mixing: Literal["wheels", "independent"] = Field(
        "wheels",
        description="wheels: left = move - turn and right = move + turn, each limited to -1..1; independent: move and "
        "turn are speeds of their own.",
    )
    ahead: Literal[1, -1] = Field(
        1, description="Which way move = 1 goes: 1 towards +x of the body, -1 towards its back."
    )
    levels: int = Field(
        0,
        ge=0,
        le=1000,
        description="How many speeds there are up to full, the nearest counts; 0 for any.",
    )
    lowest_level: int = Field(0, ge=0, description="The slowest speed but standing, counted in `levels`.")
    speed: Positive = Field(description="Of a wheel at full command [m/s].")
    track: Positive = Field(description="Between the wheels' points of contact [m].")
    axle: Number = Field(0.0, description="The wheels' axle ahead of the body's origin [m].")
    turn_rate: Positive = Field(1.0, description="At full turn, with mixing independent [rad/s].")
    gain_left: Positive = Field(1.0, description="By which the left wheel's speed is off.")
    gain_right: Positive = Field(1.0, description="Of the right wheel.")
    bias_left: Number = Field(0.0, description="Added to the left wheel's speed while it is driven [m/s].")
    bias_right: Number = Field(0.0, description="Of the right wheel [m/s].")
    dead_band: Share = Field(0.0, description="A wheel stands at commands of less than this.")
    lag: NotNegative = Field(0.0, description="Time in which a wheel comes within 1/e of its new speed [s].")
    rise: NotNegative = Field(
        0.0,
        description="Time in which the faster wheel's speed rises evenly from standing to full; it begins anew, with "
        "the other one's, where either turns the other way [s].",
    )
    delay: NotNegative = Field(0.0, description="From the command until the wheels hear it [s].")
    delay_jitter: NotNegative = Field(
        0.0, description="The delay of a step is delay + delay_jitter * U(-1, 1) [s]."
    )
    slip: Share = Field(0.0, description="Of a wheel's travel that is lost.")
    travel_noise_per_m: NotNegative = Field(
        0.0,
        description="Standard deviation of the way driven, after one meter [m]; grows with the root of the way.",
    )
    travel_noise_per_s: NotNegative = Field(0.0, description="After one second of driving [m].")
    heading_noise_per_m: NotNegative = Field(0.0, description="Of the heading, after one meter [rad].")
    heading_noise_per_s: NotNegative = Field(0.0, description="After one second of driving [rad].")
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
        """It came later: a robot without it leaves it out, so that conditions keep their hashes."""
        return _without(handler(self), {"soft_dead_band": 0.0})


class Sample(Settings):
    """What a range sensor answers at one distance."""

    distance: NotNegative = Field(description="To what is ahead [m].")
    reading: Share = Field(description="0 (nothing) to 1 (full).")


class RangeSensor(Settings):
    """A sensor that answers to what is near: 0 for nothing, 1 for very near."""

    x: Number = Field(description="Of its mount, ahead of the body's origin [m].")
    y: Number = Field(description="Of its mount, to the left [m].")
    direction: Number = Field(0.0, description="In which it looks, positive to the left [rad].")
    cone: HalfAngle = Field(0.0, description="Half the angle that it sees [rad].")
    reach: Positive = Field(description="How far it sees [m].")
    rays: int = Field(
        1,
        ge=1,
        le=63,
        description="Spread over the cone: 1, or an odd number; with lorentz 1 or 3. Responses linear and table use "
        "the nearest one, the others the light of all.",
    )
    response: Literal["linear", "ir", "table", "pulses", "lorentz"] = Field(
        "linear",
        description="linear: 1 - d / reach; ir: amplitude * exp(-d / decay); table: read from `table`; pulses: the "
        "share of `pulses` seen, as many as ir states less those missed, each with the probability of drop_*; lorentz: "
        "amplitude * (W^2 - P^2) / (d^2 - 2 P d + W^2), with W = half_width and P = peak, and 0 from the reach on.",
    )
    amplitude: NotNegative = Field(
        1.0, description="A of ir and pulses: the reading at no distance; of lorentz: at `peak`."
    )
    decay: Positive = Field(0.1, description="L of ir and pulses: where it has fallen to 1/e [m].")
    pulses: int = Field(10, ge=1, le=1000, description="Sent for one reading, with response pulses.")
    table: tuple[Sample, ...] = Field(
        (),
        max_length=64,
        description="Rows [distance, reading] by growing distance, between which lines are drawn.",
    )
    noise_uniform: NotNegative = Field(0.0, description="a: a * U(-1, 1) is added, as the paper does.")
    noise_gain: NotNegative = Field(0.0, description="Standard deviation by which a reading is multiplied.")
    drop_most: Share = Field(0.0, description="Probability that it answers 0, far away.")
    drop_at: Number = Field(0.1, description="Distance at which this is half as likely [m].")
    drop_width: Positive = Field(0.02, description="Of the logistic curve between [m].")
    outlier_most: Share = Field(0.0, description="Probability of any reading in 0..1, far away.")
    outlier_at: Number = Field(0.1, description="Distance at which this is half as likely [m].")
    outlier_width: Positive = Field(0.02, description="Of the logistic curve between [m].")
    burst: Share = Field(
        0.0, description="Of pulses: how often those of one reading share one fate, their correlation."
    )
    incidence: NotNegative = Field(
        0.0,
        description="k of ir and pulses: what a ray meets at an angle a to its normal sends back c / (c + k (1 - c)) "
        "of the light, c = cos a. 0: all; 1: as a matt surface does (Lambert).",
    )
    half_width: Positive = Field(
        0.1, description="W of lorentz: the distance at which a reading is half of that at a peak of 0 [m]."
    )
    peak: Number = Field(
        0.0,
        description="P of lorentz: the distance at which a reading is largest [m]; nearer it stays so. Less than W.",
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
                f"expected a table of at least 2 rows with response 'table', came {len(self.table)}"
            )
        if self.response != "table" and self.table:
            raise ValueError(
                f"response is {self.response!r}, which needs no table. Leave it out, or say 'table'"
            )
        far = [sample.distance for sample in self.table]
        if any(a >= b for a, b in pairwise(far)):
            raise ValueError("expected the table's rows by growing distance, each once")
        if self.response == "lorentz":
            self._check_lorentz()
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
        """Numbers that came later are left out if they are not used, so that conditions keep their hashes."""
        lorentz = {} if self.response == "lorentz" else {"half_width": 0.1, "peak": 0.0}
        return _without(handler(self), lorentz | {"compression": 0.0})


class LightSensor(Settings):
    """A sensor that answers to lights: a cosine lobe in its direction."""

    x: Number = Field(description="Of its mount, ahead of the body's origin [m].")
    y: Number = Field(description="Of its mount, to the left [m].")
    direction: Number = Field(0.0, description="In which it looks, positive to the left [rad].")
    width: Annotated[Positive, Field(le=math.pi)] = Field(
        math.pi / 2, description="Half the angle of its lobe, beyond which it sees nothing [rad]."
    )
    gain: NotNegative = Field(1.0, description="Reading for a light of strength 1 straight ahead, 1 m away.")
    noise: NotNegative = Field(0.0, description="Standard deviation by which a reading is multiplied.")


class LineSensor(Settings):
    """A sensor under the robot that tells dark floor from light floor."""

    x: Number = Field(description="Ahead of the body's origin [m].")
    y: Number = Field(description="To the left [m].")
    threshold: Share = Field(
        0.5, description="It answers 1 on floor less bright than this: 0 is black, 1 white."
    )
    noise: NotNegative = Field(0.0, description="Standard deviation added to the brightness.")
    level: bool = Field(False, description="Whether it answers how dark the floor is, in place of whether.")


class BumpSensor(Settings):
    """A switch that is closed while the body is touched near it."""

    x: Number = Field(description="Ahead of the body's origin [m].")
    y: Number = Field(description="To the left [m].")
    reach: Positive = Field(description="How near the touch must be [m].")


class Encoders(Settings):
    """What the robot knows of how far its wheels turned."""

    gain_left: Positive = Field(1.0, description="Way told for each meter that the left wheel went.")
    gain_right: Positive = Field(1.0, description="Of the right wheel.")
    noise_per_m: NotNegative = Field(
        0.0, description="Standard deviation after one meter [m]; grows with the root of the way."
    )
    drift_per_m: Number = Field(
        0.0, description="Turn to the left that is reckoned in each meter driven and did not happen [rad]."
    )


class Stall(Settings):
    """How the robot knows that it is held up."""

    kind: Literal["blocked", "idler"] = Field(
        "blocked",
        description="blocked: whatever held it up in this step; idler: as an S2, a third wheel that turns too little "
        "for what the drive wheels do.",
    )
    idler: Number = Field(0.0, description="The third wheel, ahead of the body's origin [m].")
    share: Share = Field(0.5, description="Of the drive wheels' way below which it stalls.")
    window: NotNegative = Field(1.6, description="Time over which both ways are averaged [s].")


class Looks(Settings):
    """What is only drawn."""

    wheel_diameter: float = Field(0.0, ge=0, description="[m]; 0 to draw no wheels.")
    wheel_width: float = Field(0.0, ge=0, description="[m].")
    pen: tuple[float, float] | None = Field(None, description="Where a pen is held, x and y [m].")
    caster: tuple[float, float] | None = Field(
        None, description="Where its third support touches the floor [m]."
    )


class RobotModel(Described):
    """A robot: structure, and numbers that have dotted names and may be distributions.

    Frame: x ahead, y to the left, origin midway between the wheels unless `drive.axle` says otherwise.

    Raises:
        ValueError: A value is unknown, missing or out of its range; every mistake with its place.
    """

    name: str = Field(min_length=1, max_length=80, description="What to call it.")
    description: str = Field("", max_length=2000, description="What it is, in a sentence.")
    sources: tuple[str, ...] = Field((), description="Where its numbers come from.")
    step_s: float = Field(
        0.1, gt=0, le=60, description="How long one command lasts [s]; a study may say otherwise."
    )
    body: tuple[Part, ...] = Field(
        min_length=1,
        max_length=16,
        description="What can collide: one convex part, or several fixed to each other.",
    )
    contact: Contact = Contact()
    drive: Drive
    range: tuple[RangeSensor, ...] = Field((), max_length=MOST_SENSORS, description="Range sensors.")
    light: tuple[LightSensor, ...] = Field((), max_length=MOST_SENSORS, description="Light sensors.")
    line: tuple[LineSensor, ...] = Field((), max_length=MOST_SENSORS, description="Line sensors.")
    bump: tuple[BumpSensor, ...] = Field((), max_length=MOST_SENSORS, description="Bump sensors.")
    encoder: Encoders | None = Field(None, description="Left out where wheels are not counted.")
    stall: Stall = Stall()
    shadows: Literal["none", "half", "dark"] = Field(
        "dark",
        description="How much of a light arrives behind walls and obstacles: all, half as in Jyro, or nothing.",
    )
    looks: Looks = Looks()

    def to_dict(self) -> dict[str, Any]:
        """The robot as plain values without its prose, which decides nothing; `from_dict` makes it again."""
        return {
            key: value for key, value in super().to_dict().items() if key not in ("description", "sources")
        }

    def _repr_svg_(self) -> str:
        return picture_of(self).to_svg()

    @property
    def radius(self) -> float:
        """The largest distance from the origin to a point of the body [m]."""
        return max(math.hypot(x, y) + part.radius for part in self.body for x, y in part.corners)
