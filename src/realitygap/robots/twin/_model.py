"""The parameters of a twin, as in its file, and the random numbers that its seed draws."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap._limits import is_file
from realitygap._toml import toml_value
from realitygap.errors import DescriptionError
from realitygap.settings import Settings
from realitygap.world import MOST_CORNERS, in_si, read_toml, why_no_part

MOST_MOUNTS = 16
_WIDTH = 110
DELAYS, WHEELS, LIGHT, ENCODERS, FAMILY, AMBIENT = range(6)
"""Purposes of the random numbers."""

Share = Annotated[float, Field(ge=0, le=1)]
Length = Annotated[float, Field(gt=0, le=1)]
Offset = Annotated[float, Field(ge=-0.5, le=0.5)]
Angle = Annotated[float, Field(ge=-6.3, le=6.3)]

# The shell of the paper's robot from above, its camera ahead, before it is grown by the radius of its corners.
# Source: as in the robot file of its first model, turned half round.
SHELL = (
    *((0.079, 0.0455), (0.063, 0.0615), (0.047, 0.0695), (-0.047, 0.0695), (-0.079, 0.0535)),
    *((-0.079, -0.0535), (-0.047, -0.0695), (0.047, -0.0695), (0.063, -0.0615), (0.079, -0.0455)),
)


class TwinChassis(Settings):
    """The shell, which can collide, and its mass."""

    corners: tuple[tuple[Offset, Offset], ...] = Field(
        SHELL,
        min_length=3,
        max_length=MOST_CORNERS,
        description="Corners of the shell from above, x and y [m], counter-clockwise, before `corner_radius` is added.",
    )
    corner_radius: Annotated[float, Field(ge=0.001, le=0.1)] = Field(
        0.010, description="Distance by which the shell grows on all sides, which rounds its corners [m]."
    )
    length_scale: Annotated[float, Field(ge=0.5, le=2)] = Field(
        1.0, description="Factor for the x of all corners."
    )
    width_scale: Annotated[float, Field(ge=0.5, le=2)] = Field(
        1.0, description="Factor for the y of all corners."
    )
    cardboard: tuple[Length, Length] | None = Field(
        None,
        description="Length and width of a box of cardboard around the shell [m]. Left out if there is none.",
    )
    mass: Annotated[float, Field(ge=0.1, le=10)] = Field(
        0.9, description="Mass of the robot without its wheels [kg]."
    )
    inertia: Annotated[float, Field(ge=1e-4, le=0.1)] = Field(
        0.003, description="Moment of inertia about the vertical, without the wheels [kg m2]."
    )
    center: Annotated[float, Field(ge=-0.05, le=0.05)] = Field(
        0.012,
        description="Position of the center of mass, ahead of the pen [m]. It is between the wheels and the caster.",
    )

    @model_validator(mode="after")
    def _is_convex(self) -> Self:
        problem = why_no_part(self.corners, self.corner_radius)
        if problem:
            raise ValueError(f"corners: {problem}")
        return self


class TwinWheels(Settings):
    """The two driven wheels and the other supports."""

    diameter: Annotated[float, Field(ge=0.02, le=0.2)] = Field(0.0794, description="Diameter of a wheel [m].")
    track: Annotated[float, Field(ge=0.05, le=0.4)] = Field(
        0.153, description="Distance between the contact points of the wheels with the floor [m]."
    )
    axle: Annotated[float, Field(ge=-0.05, le=0.05)] = Field(
        0.0, description="Position of the axle, ahead of the pen [m]."
    )
    friction: Annotated[float, Field(ge=0.05, le=3)] = Field(
        0.6, description="Friction coefficient mu between wheel and floor."
    )
    mass: Annotated[float, Field(ge=0.005, le=0.5)] = Field(0.03, description="Mass of one wheel [kg].")
    caster: Offset = Field(0.0758, description="Position of the third support, ahead of the pen [m].")
    caster_friction: Annotated[float, Field(ge=0, le=2)] = Field(
        0.0, description="Friction coefficient mu between caster and floor. 0: it rolls freely."
    )
    skid: Offset = Field(
        -0.065,
        description="Position of the support at the other end, ahead of the pen [m]. It touches the floor if the robot "
        "tips.",
    )


class TwinWalls(Settings):
    """Contact of the shell with walls and obstacles."""

    friction: Annotated[float, Field(ge=0, le=3)] = Field(
        0.3, description="Friction coefficient mu between shell and wall."
    )


class TwinMotors(Settings):
    """Response of the wheels to commands."""

    speed: Annotated[float, Field(ge=0.01, le=1)] = Field(
        0.15, description="Speed of a wheel at full command [m/s]."
    )
    ahead: Literal[1, -1] = Field(
        1, description="Front of the robot: 1 is the end with caster and Fluke (+x), -1 the other end."
    )
    stepped: bool = Field(
        True, description="Quantize speed to the 12 steps of an S2. It rises by at most one step in 20 ms."
    )
    lag: Annotated[float, Field(ge=0, le=2)] = Field(
        0.03, description="Time constant with which a wheel approaches its commanded speed [s]."
    )
    gain_left: Annotated[float, Field(ge=0, le=3)] = Field(
        1.0, description="Speed of the left wheel divided by its commanded speed."
    )
    gain_right: Annotated[float, Field(ge=0, le=3)] = Field(
        1.0, description="Speed of the right wheel divided by its commanded speed."
    )
    dead_band_left: Share = Field(
        0.0, description="Share of full speed below which the left wheel stands still."
    )
    dead_band_right: Share = Field(
        0.0, description="Share of full speed below which the right wheel stands still."
    )
    soft_dead_band_left: Share = Field(
        0.0,
        description="Share d of full speed up to which the left wheel stands still. Above it, the speed is "
        "(|u| - d) / (1 - d).",
    )
    soft_dead_band_right: Share = Field(0.0, description="Soft dead band of the right wheel.")
    torque: Annotated[float, Field(ge=0.005, le=1)] = Field(
        0.25, description="Maximum torque of a motor with a full battery [N m]."
    )
    stiffness: Annotated[float, Field(ge=0.002, le=0.5)] = Field(
        0.1,
        description="Torque per rad/s of speed error of a wheel [N m s]. If it is small, loads slow the wheel.",
    )
    delay: Annotated[float, Field(ge=0, le=2)] = Field(
        0.03, description="Time from a command until it reaches the motors [s]."
    )
    delay_jitter: Annotated[float, Field(ge=0, le=1)] = Field(
        0.02,
        description="Random part of the delay [s]. A command has the delay max(0, delay + delay_jitter * U(-1, 1)).",
    )
    drift_per_m: Annotated[float, Field(ge=-3, le=3)] = Field(
        0.0, description="Unwanted turn to the left per meter driven [rad]."
    )
    wander: Annotated[float, Field(ge=0, le=0.5)] = Field(
        0.01, description="Standard deviation of the slow relative fluctuation of each wheel's speed."
    )
    wander_s: Annotated[float, Field(ge=0.05, le=60)] = Field(
        1.0, description="Correlation time of this fluctuation [s]."
    )


class TwinBattery(Settings):
    """The cells that feed the motors and the infrared."""

    volts: Annotated[float, Field(ge=4, le=12)] = Field(
        8.8, description="Voltage at the start of a trial [V]."
    )
    full: Annotated[float, Field(ge=4, le=12)] = Field(
        9.0, description="Voltage at which `motors.speed` and `motors.torque` hold [V]."
    )
    fall_per_s: Annotated[float, Field(ge=0, le=0.1)] = Field(
        0.0005, description="Voltage loss per second of driving at full speed [V/s]."
    )
    sag: Annotated[float, Field(ge=0, le=3)] = Field(
        0.15, description="Voltage drop while both wheels are driven at full speed [V]."
    )
    slows: Share = Field(
        0.0, description="Effect of the voltage on speeds: 0 is none (regulated), 1 is proportional."
    )


class TwinMount(Settings):
    """Position and direction of an infrared sensor."""

    x: Offset = Field(0.089, description="Position ahead of the pen [m], before the shell is scaled.")
    y: Offset = Field(0.0, description="Position to the left of the pen [m], before the shell is scaled.")
    direction: Angle = Field(0.0, description="Direction of the sensor, positive to the left [rad].")
    gain: Annotated[float, Field(ge=0, le=10)] = Field(
        1.0, description="Factor for the light that this sensor receives."
    )


class TwinIr(Settings):
    """Infrared sensors that send pulses and count the pulses that return."""

    mount: tuple[TwinMount, ...] = Field(
        (TwinMount(), TwinMount(), TwinMount()),
        min_length=1,
        max_length=MOST_MOUNTS,
        description="Sensors from left to right. A Fluke 2 has one emitter, which it uses three times.",
    )
    cone: Annotated[float, Field(ge=0, le=1.5)] = Field(
        0.1745, description="Half the opening angle of the emitted light [rad]."
    )
    rays: int = Field(
        7, ge=1, le=63, description="Number of rays in the cone. Their returned light is added up."
    )
    half: Annotated[float, Field(ge=0.01, le=1)] = Field(
        0.12, description="Distance of a wall straight ahead at which half the pulses return [m]."
    )
    steepness: Annotated[float, Field(ge=0.3, le=20)] = Field(
        2.0, description="Steepness of the share of returned pulses: share = 1 / (1 + light ** -steepness)."
    )
    incidence: Annotated[float, Field(ge=0, le=8)] = Field(
        1.0,
        description="Exponent of the cosine between ray and wall normal, by which the returned light is multiplied.",
    )
    reach: Annotated[float, Field(ge=0.05, le=5)] = Field(
        1.0, description="Maximum distance from which light returns [m]."
    )
    pulses: int = Field(10, ge=1, le=1000, description="Number of pulses for one reading.")
    spread: Annotated[float, Field(ge=0, le=0.95)] = Field(
        0.1,
        description="Correlation of the pulses of one reading. 0: the count is binomial; above 0: it is overdispersed.",
    )
    noise: Annotated[float, Field(ge=0, le=2)] = Field(
        0.1, description="Standard deviation of the logarithm of the light from reading to reading."
    )
    memory: Annotated[float, Field(ge=0, le=0.99)] = Field(
        0.0, description="Correlation of this noise between consecutive commands."
    )
    missed: Share = Field(0.0, description="Probability that a reading is 0 regardless of the walls.")
    supply: Annotated[float, Field(ge=0, le=8)] = Field(
        1.0,
        description="Exponent of the relative battery voltage (volts / full), by which the light is multiplied.",
    )


class TwinStall(Settings):
    """Stall detection by the idler wheel, as in an S2."""

    share: Share = Field(
        0.5,
        description="The robot reports a stall if the caster rolls less than this share of the wheels' distance.",
    )
    window: Annotated[float, Field(ge=0.05, le=10)] = Field(
        1.6, description="Time over which both distances are averaged [s]."
    )


class TwinEncoders(Settings):
    """Wheel encoders: the reported distances of the wheels."""

    gain_left: Annotated[float, Field(ge=0.2, le=5)] = Field(
        1.0, description="Reported distance per meter that the left wheel turned."
    )
    gain_right: Annotated[float, Field(ge=0.2, le=5)] = Field(
        1.0, description="Reported distance per meter that the right wheel turned."
    )
    noise_per_m: Annotated[float, Field(ge=0, le=0.2)] = Field(
        0.001,
        description="Standard deviation after one meter [m]. It grows with the square root of the distance.",
    )
    count: Annotated[float, Field(ge=0, le=0.02)] = Field(
        0.00025, description="Resolution of reported distances [m]. 0: unlimited."
    )


class TwinLightMount(TwinMount):
    """Position and direction of a light sensor."""


class TwinLight(Settings):
    """Sensors of ambient light."""

    mount: tuple[TwinLightMount, ...] = Field(
        (
            TwinLightMount(x=-0.053, y=-0.018, direction=-2.7925),
            TwinLightMount(x=-0.053, y=0.0, direction=3.1416),
            TwinLightMount(x=-0.053, y=0.018, direction=2.7925),
        ),
        min_length=1,
        max_length=MOST_MOUNTS,
        description="Sensors in the order of their names. The paper's robot has them at the end without the caster.",
    )
    room: Annotated[float, Field(ge=0, le=100)] = Field(
        1.0, description="Ambient light from all sides. A lamp of strength 1 at a distance of 1 m gives 1."
    )
    lobe: Annotated[float, Field(ge=0.1, le=20)] = Field(
        2.0,
        description="Exponent of the cosine between sensor and lamp, by which the light of the lamp is multiplied.",
    )
    half: Annotated[float, Field(ge=0.001, le=100)] = Field(
        1.0, description="Light at which the reading is one half: reading = max(0, 1 - half / (2 light))."
    )
    noise: Annotated[float, Field(ge=0, le=2)] = Field(
        0.004, description="Standard deviation of the logarithm of the light from reading to reading."
    )


class TwinLine(Settings):
    """Sensors below the robot that detect a dark floor."""

    mount: tuple[tuple[Offset, Offset], ...] = Field(
        ((-0.05, -0.005), (-0.05, 0.005)),
        min_length=1,
        max_length=MOST_MOUNTS,
        description="Positions ahead of the pen and to the left of it [m], in the order of the sensors' names.",
    )
    threshold: Share = Field(0.5, description="Brightness below which the floor is dark.")


class TwinPatch(Settings):
    """A round spot of sticky floor."""

    x: Annotated[float, Field(ge=-100, le=100)] = Field(description="x of its center in the arena [m].")
    y: Annotated[float, Field(ge=-100, le=100)] = Field(description="y of its center in the arena [m].")
    radius: Annotated[float, Field(gt=0, le=100)] = Field(description="Radius of the patch [m].")
    slows: Share = Field(0.5, description="Share of its speed that a wheel loses on the patch.")


class TwinOddities(Settings):
    """Effects that the platform `sim` cannot model."""

    slope: Annotated[float, Field(ge=0, le=0.35)] = Field(0.0, description="Slope angle of the floor [rad].")
    uphill: Angle = Field(0.0, description="Uphill heading [rad].")
    turn_at: Annotated[float, Field(ge=0, le=3600)] = Field(
        0.0, description="Time in a trial at which the wheels' gains change [s]. 0: never."
    )
    turned_left: Annotated[float, Field(ge=0, le=3)] = Field(
        1.0, description="Factor for the left wheel's speed after `turn_at`."
    )
    turned_right: Annotated[float, Field(ge=0, le=3)] = Field(
        1.0, description="Factor for the right wheel's speed after `turn_at`."
    )
    compass: Share = Field(
        0.0,
        description="Effect of the heading on speed: the factor 1 + compass * cos(heading - compass_heading).",
    )
    compass_heading: Angle = Field(0.0, description="Heading at which the robot is fastest [rad].")
    latch: int = Field(
        0,
        ge=0,
        le=1000,
        description="Number of commands for which a reading is kept before the sensor is read again.",
    )
    inverted: bool = Field(False, description="True if sensors answer 1 - reading.")
    swapped: bool = Field(False, description="True if the cables of the wheels are swapped.")
    patch: TwinPatch | None = Field(None, description="A sticky spot of floor. Left out if there is none.")


class TwinModel(Settings):
    """A twin of the paper's robot: a robot with wheels, motors, and sensors in MuJoCo, used as pseudo-reality.

    Frame: origin at the pen, x towards the end with the caster and the Fluke, y to the left. Meters, radians,
    seconds, kilograms, volts.

    Raises:
        ValueError: A key is unknown or a value is out of its range. The message lists all mistakes with their places.
    """

    format: Literal["realitygap twin 1"] = Field("realitygap twin 1", description="Format of the file.")
    name: str = Field("twin", min_length=1, max_length=80, description="Name of the twin.")
    family: str = Field(
        "",
        max_length=80,
        description="Family that the twin was sampled from. Empty if it was written by hand.",
    )
    seed: int = Field(
        0, ge=0, lt=2**63, description="Seed of the noise, combined with the number of a trial."
    )
    engine: Literal["mujoco", "sim"] = Field(
        "mujoco",
        description="Physics engine: mujoco, or sim, the platform `sim` with its defaults, used like a twin. Such a "
        "twin has no gap to `sim`, and of this file only step_s and seed have an effect.",
    )
    step_s: Annotated[float, Field(ge=0.02, le=60)] = Field(0.5, description="Duration of a command [s].")
    body: TwinChassis = TwinChassis()
    wheels: TwinWheels = TwinWheels()
    walls: TwinWalls = TwinWalls()
    motors: TwinMotors = TwinMotors()
    battery: TwinBattery = TwinBattery()
    ir: TwinIr = TwinIr()
    stall: TwinStall = TwinStall()
    encoders: TwinEncoders = TwinEncoders()
    light: TwinLight | None = Field(None, description="Sensors of ambient light, if the twin has them.")
    line: TwinLine | None = Field(None, description="Line sensors, if the twin has them.")
    oddities: TwinOddities = TwinOddities()

    @model_validator(mode="after")
    def _stands(self) -> Self:
        center, axle, caster = self.body.center, self.wheels.axle, self.wheels.caster
        if not min(axle, caster) <= center <= max(axle, caster):
            raise ValueError(
                f"body.center is {center:g}, expected it between wheels.axle, {axle:g}, and wheels.caster, {caster:g}, "
                "or the robot falls over"
            )
        return self

    @model_serializer(mode="wrap")
    def _without_what_is_not_there(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out sensors and soft dead bands that the twin lacks, so that files without them keep their hashes."""
        values: dict[str, Any] = handler(self)
        soft = [name for name in values["motors"] if name.startswith("soft_") and not values["motors"][name]]
        values["motors"] = {name: value for name, value in values["motors"].items() if name not in soft}
        return {key: value for key, value in values.items() if value is not None}

    def to_toml(self) -> str:
        """Return the text of a twin file, with a comment for each number. `load_twin` reads it."""
        return _toml_of(self)


def load_twin(path: str | Path) -> TwinModel:
    """Return a twin from its file.

    Args:
        path: Path of a TOML file, as written by `TwinModel.to_toml`. Keys may end in _mm, _cm or _in, angles in _deg.

    Raises:
        DescriptionError: There is no such file, or it cannot be used: every mistake with its place.
    """
    file = Path(path)
    if not is_file(file):
        raise DescriptionError(
            f"There is no twin file {file}. Draw one: realitygap twin sample --family close -o {file.name or 'FILE'}"
        )
    written = read_toml(file, str(file))
    if "format" not in written:
        raise DescriptionError(
            f'{file} is no twin file: it does not begin with format = "realitygap twin 1".'
        )
    try:
        return TwinModel(**in_si(written))
    except ValueError as error:
        lines = [
            line.removeprefix("TwinModel.").removeprefix("TwinModel: ") for line in str(error).split("\n")
        ]
        head = f"{file} has {len(lines)} mistake{'s' if len(lines) != 1 else ''}."
        raise DescriptionError("\n  ".join([head, *lines])) from None


def numbers_for(seed: int, number: int, purpose: int, step: int = 0) -> np.random.Generator:
    """Return a generator that draws the same on every machine."""
    words = np.array([seed, number], np.uint64)
    return np.random.Generator(np.random.Philox(key=words, counter=[0, 0, step, purpose]))


def _toml_of(model: Settings) -> str:
    """Return a model as the text of its file, with the meaning of table value above it."""
    return "\n".join(_lines(model, "")) + "\n"


def _lines(model: Settings, place: str) -> Iterator[str]:
    """Yield a table's own values, then the tables in it."""
    tables: list[tuple[str, tuple[Settings, ...] | Settings]] = []
    for key, field in type(model).model_fields.items():
        value = getattr(model, key)
        if value is None:
            continue
        is_list = isinstance(value, tuple) and value and isinstance(value[0], Settings)
        if isinstance(value, Settings) or is_list:
            tables.append((key, value))
            continue
        yield from textwrap.wrap(
            field.description or "", _WIDTH, initial_indent="# ", subsequent_indent="#   "
        )
        yield f"{key} = {toml_value(value, digits=None)}"
    for key, value in tables:
        for k, table in enumerate(value if isinstance(value, tuple) else [value]):
            name = f"{place}{key}"
            header = f"[[{name}]]" if isinstance(value, tuple) else f"[{name}]"
            meaning = (type(table).__doc__ or "").strip().splitlines()[0]
            yield ""
            yield f"{header}  # {meaning}" if not k else header
            yield from _lines(table, f"{name}.") if not k else _bare(table)


def _bare(model: Settings) -> Iterator[str]:
    """Return the values of a further table of a list, without comments, which the first table has."""
    for key in type(model).model_fields:
        yield f"{key} = {toml_value(getattr(model, key), digits=None)}"
