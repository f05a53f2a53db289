"""The settings of the platform `sim`: a robot as its file describes it, with contact, motors and sensors."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    field_serializer,
    field_validator,
    model_serializer,
    model_validator,
)

from realitygap.robot_families import default_family
from realitygap.world import (
    Arena,
    Calibration,
    Distribution,
    Pose,
    RobotModel,
    load_robot,
    read_calibration,
)

from .._robot_file import RobotFilePlatform
from .._simulated import SimulatedPlatform

T = TypeVar("T")

DEFAULT_ROBOT = default_family().robot

NOISE = (
    *("noise_uniform", "noise_gain", "drop_most", "outlier_most", "noise", "noise_per_m", "delay_jitter"),
    *("travel_noise_per_m", "travel_noise_per_s", "heading_noise_per_m", "heading_noise_per_s"),
)
"""The last parts of names of numbers that are noise: 0 is none."""

ARENA = "arena."
"""First part of the names of an arena's numbers."""

POSTERIOR = "posterior"
"""The word by which numbers drawn from a calibration are drawn together."""


@functools.cache
def _named_robot(name: str) -> RobotModel:
    return load_robot(name)


def _read_draws(robot: Any) -> Calibration | None:
    """Return the calibration in a file; None if it has none, or one with mistakes, which its robot reports."""
    try:
        return read_calibration(robot) if isinstance(robot, str | Path) else None
    except ValueError:
        return None


def _as_robot(value: Any) -> Any:
    """Return a robot by name or from a file, of a calibration, or as results describe it."""
    if isinstance(value, Calibration):
        return load_robot(value.robot).with_numbers(value.numbers).model_copy(update=value.step)
    if isinstance(value, str | Path):
        value = str(value)
        try:
            return _named_robot(value) if "." not in value and "/" not in value else load_robot(value)
        except ValueError as error:
            raise ValueError(str(error).rstrip(".")) from None
    return RobotModel.from_dict(value) if isinstance(value, Mapping) else value


def as_numbers(values: Mapping[Any, Any]) -> tuple[dict[str, float | Distribution], list[str]]:
    """Return numbers by name, and distributions made of tables; and what is wrong with the others."""
    found: dict[str, float | Distribution] = {}
    problems: list[str] = []
    for name, value in values.items():
        if isinstance(value, Mapping):
            try:
                found[name] = Distribution(**value)
            except ValueError as error:
                lines = str(error).split("\n")
                problems += [name + line.removeprefix("Distribution") for line in lines]
        elif isinstance(value, Distribution):
            found[name] = value
        elif isinstance(value, bool) or not isinstance(value, int | float):
            problems.append(
                f"{name}: expected a number, or how it is drawn, such as {{ uniform = [0.1, 0.2] }}, got "
                f"{value!r}"
            )
        elif not math.isfinite(value):
            problems.append(f"{name}: expected a finite number, got {value!r}")
        else:
            found[name] = float(value)
    return found, problems


def _why_not(robot: RobotModel, numbers: Mapping[str, float | Distribution]) -> list[str]:
    """Return mistakes in numbers of a robot."""
    own = {name: value for name, value in numbers.items() if not name.startswith(ARENA)}
    settings = [name for name in own if name in SimSettings.model_fields]
    problems = [f"{name}: a setting of [platform.sim] itself, write it there" for name in settings]
    try:
        robot.with_numbers({name: value for name, value in own.items() if name not in settings})
    except ValueError as error:
        problems += [line.removeprefix("RobotModel").lstrip(".: ") for line in str(error).split("\n")]
    return problems


class SimSettings(RobotFilePlatform, SimulatedPlatform):
    """The settings of `sim`, and what follows from them alone."""

    name: ClassVar[str] = "sim"
    summary: ClassVar[str] = (
        "a simulated robot: with its outline, contact, motors and sensors, as its file and the settings have them"
    )
    rest: ClassVar[str] = "FILE"
    rest_setting: ClassVar[str] = "robot"
    file_settings: ClassVar[tuple[str, ...]] = ("robot",)
    records_draws: ClassVar[bool] = True
    takes_several: ClassVar[bool] = True

    robot: Annotated[RobotModel, BeforeValidator(_as_robot)] = Field(
        default_factory=lambda: _named_robot(DEFAULT_ROBOT),
        description="Robot by name (`realitygap show robot`), robot file, or calibration, which is a robot with fitted "
        f"numbers. Default: {DEFAULT_ROBOT}. Results store its whole content.",
    )
    steps: int = Field(
        100, ge=1, le=100_000, description="Steps of a trial: commands (section 2.2, the paper's robot: 100)."
    )
    step_s: float = Field(
        0.0, ge=0, le=60, description="Duration of a command [s]; 0: that of the robot file."
    )
    contact: Literal["robot", "freeze", "stop", "slide"] = Field(
        "robot",
        description="Contact with walls. robot: that of the robot file. freeze: as in Jyro. stop: the robot turns if "
        "its body allows. slide: it skids and turns along walls.",
    )
    noise: bool = Field(
        True,
        description="Use the noise of sensors and motors in the robot file. A condition's own noise, the paper's a, is "
        "added to it.",
    )
    noisy_reading: Literal["leave", "clip"] = Field(
        "leave",
        description="Treatment of a reading after the paper's noise is added: leave it, or clip it to 0..1. It applies "
        "to sensors with a linear response.",
    )
    set: dict[str, float | Distribution] = Field(
        default_factory=dict,
        description="Numbers of the robot and of the arena by dotted name: a value, or a distribution. Distributions "
        "are uniform = [least, most], normal = [mean, standard deviation], log_uniform, and choice. A value is drawn "
        'per "trial" (the default), "run", or "study", such as '
        '"drive.track" = { normal = [0.153, 0.002], per = "run" }.',
    )
    precision: Literal["single", "double"] = Field(
        "single", description="Precision of the arithmetic of trials: 32 or 64 bits."
    )
    randomize: Literal["no", "posterior"] = Field(
        "no",
        description="Draws of robots from a calibration. posterior: all fitted numbers together, from its draws. "
        "Numbers of `set` replace drawn ones.",
    )
    randomize_per: Literal["trial", "run", "study"] = Field(
        "trial", description="Unit of work that shares one draw from a calibration."
    )
    draws: dict[str, tuple[float, ...]] = Field(
        default_factory=dict,
        description="Draws of the calibration, by dotted name, so that results need no file.",
        json_schema_extra={"hidden": True},
        repr=False,
    )

    @model_validator(mode="before")
    @classmethod
    def _robot_may_be_a_calibration(cls, values: Any) -> Any:
        """Keep the draws of a calibration with its robot."""
        if not isinstance(values, Mapping) or "draws" in values:
            return values
        robot = values.get("robot")
        calibration = robot if isinstance(robot, Calibration) else _read_draws(robot)
        if calibration is None or not calibration.draws:
            return values
        return {**values, "draws": dict(calibration.draws)}

    @field_validator("set", mode="before")
    @classmethod
    def _numbers_are_such(cls, values: Any, info: ValidationInfo) -> Any:
        """Report all mistakes together; numbers of the arena are checked with the arena."""
        if not isinstance(values, Mapping):
            return values
        numbers, problems = as_numbers(values)
        if "robot" in info.data:
            problems += _why_not(info.data["robot"], numbers)
        if problems:
            raise ValueError("; ".join(line.rstrip(".") for line in problems))
        return numbers

    @model_validator(mode="after")
    def _draws_are_as_many(self) -> Self:
        if len({len(values) for values in self.draws.values()}) > 1:
            raise ValueError("draws: expected as many of each number")
        return self

    @model_validator(mode="after")
    def _numbers_are_the_robots(self) -> Self:
        try:
            self.model  # noqa: B018 - made to see whether it can be
        except ValueError as error:
            lines = [line.removeprefix("RobotModel").lstrip(".: ") for line in str(error).split("\n")]
            raise ValueError("set: " + "; ".join(line.rstrip(".") for line in lines)) from None
        return self

    @model_serializer(mode="wrap")
    def _without_what_is_not_drawn(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave draws out if nothing is drawn from the calibration: conditions keep their hashes."""
        values: dict[str, Any] = handler(self)
        unused = () if self.randomize == "posterior" else ("randomize", "randomize_per", "draws")
        return {key: value for key, value in values.items() if key not in unused}

    @field_serializer("robot")
    def _robot_as_resolved(self, robot: RobotModel) -> dict[str, Any]:
        return robot.to_dict()

    @field_serializer("set")
    def _set_as_plain(self, values: dict[str, float | Distribution]) -> dict[str, Any]:
        return {
            name: value.to_dict() if isinstance(value, Distribution) else value
            for name, value in values.items()
        }

    @functools.cached_property
    def model(self) -> RobotModel:
        """The robot with its numbers as set, with the chosen contact, and without noise if the settings exclude it."""
        robot = self.robot
        if self.contact != "robot":
            contact = robot.contact.model_copy(update={"model": self.contact})
            robot = robot.model_copy(update={"contact": contact})
        changed: dict[str, float | Distribution] = {}
        if self.randomize == "posterior":
            changed |= {
                name: Distribution(choice=values, per=self.randomize_per, together=POSTERIOR)
                for name, values in self.draws.items()
            }
        if not self.noise:
            changed |= {name: 0.0 for name in robot.numbers() if name.rpartition(".")[2] in NOISE}
        changed |= {name: value for name, value in self.set.items() if not name.startswith(ARENA)}
        return robot.with_numbers(changed) if changed else robot

    @property
    def arena_numbers(self) -> dict[str, float | Distribution]:
        """Numbers of the arena among `set`."""
        return {name: value for name, value in self.set.items() if name.startswith(ARENA)}

    @property
    def command_s(self) -> float:
        """Duration of a command [s]."""
        return self.step_s or self.model.step_s

    @property
    def title(self) -> str:
        """Title of its picture."""
        return f"{self.model.name} ({self.label})"

    @property
    def spec(self) -> str:
        """Its name. Results store the whole robot instead of the file."""
        return self.name

    @property
    def robot_model(self) -> RobotModel:
        """The robot with its numbers as set."""
        return self.model

    @property
    def is_randomized(self) -> bool:
        """True if its robots are drawn from a calibration."""
        return self.randomize == "posterior"

    def randomized(self, how: str) -> Self:
        """Return the platform with robots drawn from their calibration, or not; itself without draws."""
        if not self.draws:
            return self
        return type(self)(**{**self._values(), "randomize": how})

    def at_pace(self, step_s: float) -> Self:
        """Return the platform with a robot whose commands last so long, unless its settings fix the duration [s]."""
        if self.step_s or self.robot.step_s == step_s:
            return self
        return type(self)(**{**self._values(), "robot": self.robot.model_copy(update={"step_s": step_s})})

    def _values(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in type(self).model_fields}

    def lasting(self, step_s: float) -> Self:
        """Return the platform with commands of another duration [s]."""
        return self.model_copy(update={"step_s": step_s})

    def placed(self, arena: Arena, start: Pose) -> tuple[Self, Arena]:
        """Return platform and arena with trials that begin at a pose, and no number that would move it."""
        fixed = self.model_copy(update={"set": _without_start(self.set)})
        return fixed, replace(arena, start=start, vary=_without_start(arena.vary))


def _without_start(numbers: Mapping[str, T]) -> dict[str, T]:
    """Return the numbers without those of the start."""
    return {name: value for name, value in numbers.items() if not name.startswith("arena.start.")}
