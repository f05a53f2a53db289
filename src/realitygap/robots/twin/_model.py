"""What a twin is: every number of a robot of real wheels, motors and sensors, as a file describes it."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap.settings import Settings
from realitygap.world import MOST_CORNERS, why_no_part

from ._toml import toml_of

MOST_MOUNTS = 16

Share = Annotated[float, Field(ge=0, le=1)]
Length = Annotated[float, Field(gt=0, le=1)]
Offset = Annotated[float, Field(ge=-0.5, le=0.5)]
Angle = Annotated[float, Field(ge=-6.3, le=6.3)]

# The Scribbler's shell from above, the end with the Fluke ahead, before it is grown by the radius of its corners.
# Source: as in world/robots/scribbler-s1.toml, turned half round.
SHELL = (
    *((0.079, 0.0455), (0.063, 0.0615), (0.047, 0.0695), (-0.047, 0.0695), (-0.079, 0.0535)),
    *((-0.079, -0.0535), (-0.047, -0.0695), (0.047, -0.0695), (0.063, -0.0615), (0.079, -0.0455)),
)


class TwinChassis(Settings):
    """What can collide, and how heavy it is."""

    corners: tuple[tuple[Offset, Offset], ...] = Field(
        SHELL,
        min_length=3,
        max_length=MOST_CORNERS,
        description="Of the shell from above, x and y [m], counter-clockwise, before they are grown.",
    )
    corner_radius: Annotated[float, Field(ge=0.001, le=0.1)] = Field(
        0.010, description="By which the shell is grown to all sides, which rounds its corners [m]."
    )
    length_scale: Annotated[float, Field(ge=0.5, le=2)] = Field(
        1.0, description="By which the x of all corners is multiplied."
    )
    width_scale: Annotated[float, Field(ge=0.5, le=2)] = Field(1.0, description="Of their y.")
    cardboard: tuple[Length, Length] | None = Field(
        None,
        description="Length and width of a box of cardboard around the shell [m]; left out where there is none.",
    )
    mass: Annotated[float, Field(ge=0.1, le=10)] = Field(0.9, description="Of all but the wheels [kg].")
    inertia: Annotated[float, Field(ge=1e-4, le=0.1)] = Field(
        0.003, description="Of all but the wheels, about the vertical [kg m2]."
    )
    center: Annotated[float, Field(ge=-0.05, le=0.05)] = Field(
        0.012, description="Of its mass, ahead of the pen [m]: between the wheels and the caster."
    )

    @model_validator(mode="after")
    def _is_convex(self) -> Self:
        problem = why_no_part(self.corners, self.corner_radius)
        if problem:
            raise ValueError(f"corners: {problem}")
        return self


class TwinWheels(Settings):
    """The two driven wheels, and what they stand on besides."""

    diameter: Annotated[float, Field(ge=0.02, le=0.2)] = Field(0.0794, description="[m].")
    track: Annotated[float, Field(ge=0.05, le=0.4)] = Field(
        0.153, description="Between their points of contact with the floor [m]."
    )
    axle: Annotated[float, Field(ge=-0.05, le=0.05)] = Field(0.0, description="Ahead of the pen [m].")
    friction: Annotated[float, Field(ge=0.05, le=3)] = Field(0.6, description="Between wheel and floor: mu.")
    mass: Annotated[float, Field(ge=0.005, le=0.5)] = Field(0.03, description="Of one wheel [kg].")
    caster: Offset = Field(
        0.0758, description="Where the third support touches the floor, ahead of the pen [m]."
    )
    caster_friction: Annotated[float, Field(ge=0, le=2)] = Field(
        0.0, description="Between it and the floor: mu; 0 where it rolls freely."
    )
    skid: Offset = Field(
        -0.065, description="What touches the floor where it tips to the other end, likewise [m]."
    )


class TwinWalls(Settings):
    """How the shell meets walls and obstacles."""

    friction: Annotated[float, Field(ge=0, le=3)] = Field(0.3, description="Between shell and wall: mu.")


class TwinMotors(Settings):
    """How commands turn the wheels."""

    speed: Annotated[float, Field(ge=0.01, le=1)] = Field(
        0.15, description="Speed of a wheel at full command [m/s]."
    )
    ahead: Literal[1, -1] = Field(
        1, description="Which end is ahead: 1 the one with caster and Fluke (+x), -1 the other one."
    )
    stepped: bool = Field(
        True, description="Whether speeds come in an S2's 12 steps, and rise by one of them each 20 ms."
    )
    lag: Annotated[float, Field(ge=0, le=2)] = Field(
        0.03, description="Time in which a wheel comes within 1/e of the speed it is told [s]."
    )
    gain_left: Annotated[float, Field(ge=0, le=3)] = Field(
        1.0, description="Speed of the left wheel for each that it is told."
    )
    gain_right: Annotated[float, Field(ge=0, le=3)] = Field(1.0, description="Of the right wheel.")
    dead_band_left: Share = Field(
        0.0, description="Share of full speed below which the left wheel stands still."
    )
    dead_band_right: Share = Field(0.0, description="Of the right wheel.")
    soft_dead_band_left: Share = Field(
        0.0,
        description="Share d of full speed up to which the left wheel stands still, and from which it starts from 0: "
        "(|u| - d) / (1 - d).",
    )
    soft_dead_band_right: Share = Field(0.0, description="Soft dead band of the right wheel.")
    torque: Annotated[float, Field(ge=0.005, le=1)] = Field(
        0.25, description="The most that a motor gives, on a full battery [N m]."
    )
    stiffness: Annotated[float, Field(ge=0.002, le=0.5)] = Field(
        0.1,
        description="Torque against each rad/s by which a wheel is off [N m s]: little lets loads slow it.",
    )
    delay: Annotated[float, Field(ge=0, le=2)] = Field(
        0.03, description="From a command until the wheels hear it [s]."
    )
    delay_jitter: Annotated[float, Field(ge=0, le=1)] = Field(
        0.02, description="The delay of a command is delay + delay_jitter * U(-1, 1), and at least 0 [s]."
    )
    drift_per_m: Annotated[float, Field(ge=-3, le=3)] = Field(
        0.0, description="Turn to the left in each meter driven [rad]."
    )
    wander: Annotated[float, Field(ge=0, le=0.5)] = Field(
        0.01, description="Standard deviation of the share by which each wheel's speed wanders."
    )
    wander_s: Annotated[float, Field(ge=0.05, le=60)] = Field(
        1.0, description="Time in which it forgets how it was [s]."
    )


class TwinBattery(Settings):
    """The cells that feed the motors and the infrared."""

    volts: Annotated[float, Field(ge=4, le=12)] = Field(8.8, description="At the start of a trial [V].")
    full: Annotated[float, Field(ge=4, le=12)] = Field(
        9.0, description="At which speeds and torques are as said above [V]."
    )
    fall_per_s: Annotated[float, Field(ge=0, le=0.1)] = Field(
        0.0005, description="Lost in each second of driving at full speed [V/s]."
    )
    sag: Annotated[float, Field(ge=0, le=3)] = Field(
        0.15, description="By which the voltage falls while both wheels are driven at full speed [V]."
    )
    slows: Share = Field(
        0.0, description="How far speeds follow the voltage: 0 where they are regulated, 1 in proportion."
    )


class TwinMount(Settings):
    """Where an infrared sensor is."""

    x: Offset = Field(0.089, description="Ahead of the pen [m], before the shell is scaled.")
    y: Offset = Field(0.0, description="To the left of it [m], likewise.")
    direction: Angle = Field(0.0, description="In which it looks, positive to the left [rad].")
    gain: Annotated[float, Field(ge=0, le=10)] = Field(
        1.0, description="By which its light is stronger than that of others."
    )


class TwinIr(Settings):
    """Infrared sensors that send pulses and count those that come back."""

    mount: tuple[TwinMount, ...] = Field(
        (TwinMount(), TwinMount(), TwinMount()),
        min_length=1,
        max_length=MOST_MOUNTS,
        description="From left to right; a Fluke 2 asks its one emitter three times.",
    )
    cone: Annotated[float, Field(ge=0, le=1.5)] = Field(
        0.1745, description="Half the angle in which it sends light [rad]."
    )
    rays: int = Field(7, ge=1, le=63, description="Rays in the cone; each sends back light of its own.")
    half: Annotated[float, Field(ge=0.01, le=1)] = Field(
        0.12, description="Distance of a wall, straight ahead, from which half the pulses come back [m]."
    )
    steepness: Annotated[float, Field(ge=0.3, le=20)] = Field(
        2.0, description="Of the pulses' share over the light: share = 1 / (1 + light ** -steepness)."
    )
    incidence: Annotated[float, Field(ge=0, le=8)] = Field(
        1.0, description="Power of the cosine between ray and wall's normal that light comes back with."
    )
    reach: Annotated[float, Field(ge=0.05, le=5)] = Field(
        1.0, description="Beyond which nothing comes back [m]."
    )
    pulses: int = Field(10, ge=1, le=1000, description="Sent for one reading.")
    spread: Annotated[float, Field(ge=0, le=0.95)] = Field(
        0.1, description="Correlation of the pulses of one reading: 0 is binomial, more is over-dispersed."
    )
    noise: Annotated[float, Field(ge=0, le=2)] = Field(
        0.1, description="Standard deviation of the logarithm of the light from reading to reading."
    )
    memory: Annotated[float, Field(ge=0, le=0.99)] = Field(
        0.0, description="Correlation of this noise between a command and the next."
    )
    missed: Share = Field(0.0, description="Probability that a reading is 0 whatever is there.")
    supply: Annotated[float, Field(ge=0, le=8)] = Field(
        1.0, description="Power of the battery's share of its full voltage that the light goes with."
    )


class TwinStall(Settings):
    """How it knows that it is held up: as an S2, by its idler wheel."""

    share: Share = Field(
        0.5, description="It stalls where the caster rolls less than this share of what the wheels turn."
    )
    window: Annotated[float, Field(ge=0.05, le=10)] = Field(
        1.6, description="Time over which both are averaged [s]."
    )


class TwinEncoders(Settings):
    """What it knows of how far its wheels turned."""

    gain_left: Annotated[float, Field(ge=0.2, le=5)] = Field(
        1.0, description="Way told for each meter that the left wheel turned."
    )
    gain_right: Annotated[float, Field(ge=0.2, le=5)] = Field(1.0, description="Of the right wheel.")
    noise_per_m: Annotated[float, Field(ge=0, le=0.2)] = Field(
        0.001, description="Standard deviation after one meter [m]; grows with the root of the way."
    )
    count: Annotated[float, Field(ge=0, le=0.02)] = Field(
        0.00025, description="In which ways are told [m]; 0 for any."
    )


class TwinLightMount(TwinMount):
    """Place and direction of a light sensor."""


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
        description="Sensors in the order of their names; a Scribbler has them at the end without the caster.",
    )
    room: Annotated[float, Field(ge=0, le=100)] = Field(
        1.0, description="Light of the room from all sides; a lamp of strength 1 at 1 m gives 1."
    )
    lobe: Annotated[float, Field(ge=0.1, le=20)] = Field(
        2.0, description="Power of the cosine between sensor and lamp that light arrives with."
    )
    half: Annotated[float, Field(ge=0.001, le=100)] = Field(
        1.0, description="Light at which the reading is one half: reading = 1 - half / (2 light), at least 0."
    )
    noise: Annotated[float, Field(ge=0, le=2)] = Field(
        0.004, description="Standard deviation of the logarithm of the light from reading to reading."
    )


class TwinLine(Settings):
    """Sensors below it, which see whether the floor is dark."""

    mount: tuple[tuple[Offset, Offset], ...] = Field(
        ((-0.05, -0.005), (-0.05, 0.005)),
        min_length=1,
        max_length=MOST_MOUNTS,
        description="Ahead of the pen and to the left of it [m], in the order of their names.",
    )
    threshold: Share = Field(0.5, description="Brightness below which the floor is dark.")


class TwinPatch(Settings):
    """A round spot of sticky floor."""

    x: Annotated[float, Field(ge=-100, le=100)] = Field(description="Of its center in the arena [m].")
    y: Annotated[float, Field(ge=-100, le=100)] = Field(description="[m].")
    radius: Annotated[float, Field(gt=0, le=100)] = Field(description="[m].")
    slows: Share = Field(0.5, description="Share of a wheel's speed that is lost on it.")


class TwinOddities(Settings):
    """What the platform `sim` has no numbers for."""

    slope: Annotated[float, Field(ge=0, le=0.35)] = Field(
        0.0, description="By which the floor is tilted [rad]."
    )
    uphill: Angle = Field(0.0, description="Heading in which it rises [rad].")
    turn_at: Annotated[float, Field(ge=0, le=3600)] = Field(
        0.0, description="Time in a trial at which gains change [s]."
    )
    turned_left: Annotated[float, Field(ge=0, le=3)] = Field(
        1.0, description="By which the left wheel's speed is multiplied from then on."
    )
    turned_right: Annotated[float, Field(ge=0, le=3)] = Field(1.0, description="The right wheel's.")
    compass: Share = Field(
        0.0, description="Share of the speed that is lost or gained with the cosine of the heading."
    )
    compass_heading: Angle = Field(0.0, description="Heading in which it is fastest [rad].")
    latch: int = Field(
        0, ge=0, le=1000, description="Commands for which a reading is held before the sensor is asked again."
    )
    inverted: bool = Field(False, description="Whether sensors answer 1 - reading.")
    swapped: bool = Field(False, description="Whether the wheels' cables are swapped.")
    patch: TwinPatch | None = Field(None, description="A sticky spot of floor; left out where there is none.")


class TwinModel(Settings):
    """A twin of the Scribbler: a robot of wheels, motors and sensors in MuJoCo, as pseudo-reality.

    Frame: origin at the pen, x towards the end with the caster, which is the Fluke's, y to the left. Meters, radians,
    seconds, kilograms, volts.

    Raises:
        ValueError: A value is unknown or out of its range; every mistake with its place.
    """

    format: Literal["realitygap twin 1"] = Field("realitygap twin 1", description="Of the file.")
    name: str = Field("twin", min_length=1, max_length=80, description="What to call it.")
    family: str = Field("", max_length=80, description="From which it was drawn; empty where by hand.")
    seed: int = Field(0, ge=0, lt=2**63, description="Of its noise, together with the number of a trial.")
    engine: Literal["mujoco", "sim"] = Field(
        "mujoco",
        description="What moves it: mujoco; or sim, the platform `sim` with its defaults behind the same wall, to "
        "which there is no gap. Of all else in the file, sim takes only step_s and seed.",
    )
    step_s: Annotated[float, Field(ge=0.02, le=60)] = Field(0.5, description="How long a command lasts [s].")
    body: TwinChassis = TwinChassis()
    wheels: TwinWheels = TwinWheels()
    walls: TwinWalls = TwinWalls()
    motors: TwinMotors = TwinMotors()
    battery: TwinBattery = TwinBattery()
    ir: TwinIr = TwinIr()
    stall: TwinStall = TwinStall()
    encoders: TwinEncoders = TwinEncoders()
    light: TwinLight | None = Field(None, description="Sensors of ambient light, if it has them.")
    line: TwinLine | None = Field(None, description="Line sensors, if it has them.")
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
        """A twin without these sensors, or without a soft dead band, is written as before there were any."""
        values: dict[str, Any] = handler(self)
        soft = [name for name in values["motors"] if name.startswith("soft_") and not values["motors"][name]]
        values["motors"] = {name: value for name, value in values["motors"].items() if name not in soft}
        return {key: value for key, value in values.items() if value is not None}

    def to_toml(self) -> str:
        """The twin as a file, every number with its meaning; `load_twin` reads it."""
        return toml_of(self)
