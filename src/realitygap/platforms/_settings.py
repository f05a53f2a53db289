"""The settings of a platform and what it can do, without how it is opened."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import Field

from realitygap.drawing import Picture
from realitygap.errors import StudyError
from realitygap.evolution import ControllerInterface, inputs_of_robot
from realitygap.robot_families import default_family
from realitygap.settings import Settings
from realitygap.world import JYRO_SCRIBBLER, Arena, Body, RangeSensors, RobotModel, check_start, robot_picture


class PlatformSettings(Settings):
    """The settings of a platform, `[platform.NAME]` of a study file, and its capabilities.

    Figures draw the paper's robot unless a subclass has another `body`.

    Attributes:
        name: The part before the colon.
        summary: Summary: a few words, a colon, and details.
        rest: Part of the name after the colon, such as FILE; empty if there is none.
        rest_setting: The setting that it fills.
        needs_rest: True if the name alone is no platform.
        file_settings: Settings that may name a file next to the study file.
        default_noise: The paper's level a, if a study does not set it.
        takes_noise: Whether level a may be added to its readings.
        is_physical: Whether a person has to place its robots: their trials go into a ledger.
        is_simulator: Whether trials are computed, many in one call.
        is_slow: Whether one run is enough work for a process.
        is_paced: Whether a command lasts as long as a robot's command.
        records_draws: Whether results have a column of the numbers that were drawn for each trial.
        runs_whole: Whether `run_whole` computes whole evolutions of the task coverage.
        is_for_studies: Whether a condition of a study can be on it.
        channels: Names of the sensors that its robots have besides range sensors, such as `light.0`.
        takes_several: Whether several robots can be tried in one arena.
        full_scale: Raw reading that counts as 1 in stored trials, independent of a study's scale of readings.
        base_robot: Name of the robot file that calibrations of its robots build on.
        version: Version of its code, if another package or a file adds it: results of another version are not extended.
    """

    name: ClassVar[str]
    summary: ClassVar[str] = ""
    rest: ClassVar[str] = ""
    rest_setting: ClassVar[str] = ""
    needs_rest: ClassVar[bool] = False
    file_settings: ClassVar[tuple[str, ...]] = ()
    default_noise: ClassVar[float] = 0.0
    takes_noise: ClassVar[bool] = False
    is_physical: ClassVar[bool] = False
    is_simulator: ClassVar[bool] = False
    is_slow: ClassVar[bool] = True
    is_paced: ClassVar[bool] = True
    records_draws: ClassVar[bool] = False
    runs_whole: ClassVar[bool] = False
    is_for_studies: ClassVar[bool] = True
    channels: ClassVar[tuple[str, ...]] = ()
    takes_several: ClassVar[bool] = False
    full_scale: ClassVar[float] = 1.0
    base_robot: ClassVar[str] = default_family().robot
    version: ClassVar[str] = ""

    steps: int = Field(100, ge=1, le=100_000, description="Steps of a trial.")

    @classmethod
    def specs(cls) -> tuple[str, ...]:
        """Return the ways in which users name it."""
        alone = () if cls.needs_rest else (cls.name,)
        return (*alone, f"{cls.name}:{cls.rest}") if cls.rest else alone

    @classmethod
    def from_rest(cls, rest: str) -> Self:
        """Return the platform that `NAME:REST` names, with default settings.

        Raises:
            ValueError: There is no such file, or it cannot be used.
        """
        return cls(**({cls.rest_setting: rest} if rest else {}))

    @classmethod
    def base_robot_at(cls, rest: str) -> str:
        """Return the robot file that calibrations of the robot at `NAME:REST` build on."""
        return cls.base_robot

    @classmethod
    def kind_of_file(cls, path: Path) -> str:
        """Return the kind of a file that `NAME:FILE` can name, such as twin; empty for other files."""
        return ""

    @property
    def spec(self) -> str:
        """The name of this platform as users write it."""
        rest = getattr(self, self.rest_setting) if self.rest_setting else ""
        return f"{self.name}:{rest}" if isinstance(rest, str) and rest else self.name

    @property
    def fingerprint(self) -> str:
        """The name and a hash of all settings, equal for equal robots."""
        settings = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return f"{self.name} {hashlib.sha256(settings.encode()).hexdigest()[:16]}"

    def identified(self) -> Self:
        """Return the platform with the hash of each file that it does not store whole.

        Raises:
            ValueError: A file is missing, or cannot be read.
        """
        return self

    @property
    def label(self) -> str:
        """The label of its figures: SIM, TWIN, EMULATED or REAL."""
        return "SIM"

    @property
    def is_single(self) -> bool:
        """True if trials are computed and recorded in 32 bits."""
        return getattr(self, "precision", "double") == "single"

    @property
    def command_s(self) -> float:
        """Duration of a command [s]."""
        return 0.5

    @property
    def body(self) -> Body:
        """Outline of the robot in figures: the box of 0.18 x 0.16 m around the paper's robot."""
        return JYRO_SCRIBBLER

    @property
    def sensors(self) -> RangeSensors:
        """Range sensors in figures: three rays from the front, as far as the paper trusts readings (9 in)."""
        return RangeSensors(((0.09, 0.05, 0.0), (0.09, 0.0, 0.0), (0.09, -0.05, 0.0)), 0.2286)

    @property
    def title(self) -> str:
        """Title of its picture."""
        return f"{self.name} ({self.label})"

    def picture(self) -> Picture:
        """Return the robot from above, to scale, with its dimensions."""
        return robot_picture(self.title, self.body, self.sensors)

    def _repr_svg_(self) -> str:
        return self.picture().to_svg(300.0)

    @property
    def needs_person(self) -> bool:
        """True if a person has to place its robot."""
        return self.is_physical

    @property
    def robot_model(self) -> RobotModel | None:
        """The robot file's model, whose numbers can be set and drawn; None if there is none."""
        return None

    @property
    def arena_numbers(self) -> dict[str, Any]:
        """Numbers of the arena that its settings change, by dotted name."""
        return {}

    @property
    def is_randomized(self) -> bool:
        """True if its robots are drawn from a calibration."""
        return False

    def randomized(self, how: str) -> Self:
        """Return the platform with robots drawn from their calibration, or not; itself if it has none."""
        return self

    def at_pace(self, step_s: float) -> Self:
        """Return the platform with a robot whose commands last so long, unless its settings fix the duration [s]."""
        return self

    def in_double(self) -> Self:
        """Return the platform with double precision, if it has a choice."""
        return (
            self.model_copy(update={"precision": "double"})
            if "precision" in type(self).model_fields
            else self
        )

    def inputs(self, arena: Arena) -> tuple[str, ...]:
        """Return the names of all inputs that networks can have here."""
        return inputs_of_robot(len(self.sensors.mounts), self.channels)

    def drawn_names(self, arena: Arena, inputs: Sequence[str], noise: float) -> tuple[str, ...]:
        """Return the dotted names of the numbers that are drawn for trials, in the order of the records."""
        return ()

    def check(self, arena: Arena, inputs: Sequence[str], noise: float) -> None:
        """Raise an error if networks with these inputs cannot be tried here.

        Raises:
            ValueError: An input is missing, level a is not taken, or the arena cannot be used.
        """
        self.check_noise(noise)
        ControllerInterface(tuple(inputs)).check(self.inputs(arena), "A network", f"platform {self.name!r}")

    def check_noise(self, noise: float) -> None:
        """Raise an error if level a cannot be added to its readings.

        Raises:
            ValueError: The platform takes no noise.
        """
        if noise and not self.takes_noise:
            raise ValueError(
                f"noise is {noise:g}, expected none with platform {self.name!r}: its readings are noisy by "
                "themselves. Leave it out."
            )

    def check_robots(self, arena: Arena) -> None:
        """Raise an error if there are several robots in the arena, and the platform takes one.

        Raises:
            ValueError: There are several, and it takes one.
        """
        if arena.others and not self.takes_several:
            raise ValueError(
                f"arena.robots is {arena.n_robots}, expected 1 with platform {self.name!r}. Choose a platform that "
                "takes several robots in an arena, such as sim."
            )

    def check_starts(self, arena: Arena) -> None:
        """Raise an error if the robot does not fit at the start.

        Raises:
            ValueError: The robot does not fit.
        """
        check_start(arena, self.body)

    @property
    def outline_words(self) -> str:
        """The origin of the outline in figures, for their captions."""
        return "the box around the paper’s robot"

    def at_port(self, port: str) -> Self:
        """Return the platform with the port of its robot.

        Raises:
            StudyError: It has no port.
        """
        raise StudyError(f"Platform {self.name!r} has no robot on a port.")

    def in_arena(self, arena: Arena) -> Self:
        """Return the platform with the arena that an emulated robot in this program begins with; itself by default."""
        return self
