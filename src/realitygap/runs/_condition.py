"""One condition of a study, as resolved, with all settings that determine its runs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    Field,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    ValidationError,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic.functional_validators import ModelWrapValidatorHandler
from pydantic_core import InitErrorDetails

from realitygap._version import __version__
from realitygap.errors import RecordVersionError, did_you_mean
from realitygap.evolution import DISTANCES, NeatSettings, NoveltySettings, random_key
from realitygap.kernels.neat.genome import NeatRules
from realitygap.platforms import (
    PYTHON,
    JyroPlatform,
    Platform,
    platform_class,
    platform_names,
    study_platforms,
)
from realitygap.robot_families import default_family
from realitygap.settings import Settings, mistakes, shown
from realitygap.tasks import ControllerSettings, CoverageTask, PythonFunction, PythonTask, Task, as_task
from realitygap.trials import MOST_TEAMS, Trajectory
from realitygap.world import Arena, ArenaSettings

from ._map_elites import ArchiveSettings

# A condition's name is part of file names.
NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"

# Trials of a run: with some 600 bytes for the row of each, 3 GB.
MOST_TRIALS = 5_000_000

Selection = Literal["coverage", "fitness", "novelty", "random", "map-elites"]


class Condition(Settings):
    """One cell of a study's design.

    Its runs are a function of these values and the number of the replicate alone.
    """

    name: str = Field(
        pattern=NAME_PATTERN, max_length=80, description="Letters, digits, dot, dash and underscore."
    )
    selection: Selection = Field(
        "coverage",
        description="Rule that selects parents. coverage: the paper's objective NEAT. fitness: the fitness of another "
        "task. novelty: novelty search. random: no selection, a control that the paper lacks. It tries the same "
        "number of random networks. map-elites: the fittest of each cell of an archive of descriptors.",
    )
    platform: str = Field(
        "jyro",
        description="Platform that drives the networks. jyro: the paper's simulation. sim: a robot simulated with its "
        "outline, contact, motors, and sensors (sim:FILE: the robot of a file). twin:FILE: pseudo-reality in MuJoCo. "
        f"{default_family().name}: the robot. Other packages can add platforms.",
    )
    noise: float = Field(
        0.1,
        ge=0,
        le=10,
        description="Noise level a. a * U(-1, 1) is added to each reading before the largest is taken (section 2.3: "
        "0.1, 0.5, 0.8). A robot and a twin allow only 0, because their own readings are noisy. On sim, the default is "
        "0, and the level adds to the robot's own noise.",
    )
    seed: int = Field(1, ge=0, le=2**63 - 1, description="Seed of the study's random numbers.")
    pair: bool = Field(
        True,
        description="Use the same random numbers for all conditions of a study. This narrows the intervals of their "
        "differences.",
    )
    arena: ArenaSettings = ArenaSettings()
    task: Annotated[SerializeAsAny[Settings], BeforeValidator(as_task)] = CoverageTask()
    controller: ControllerSettings = ControllerSettings()
    neat: NeatSettings = NeatSettings.named("rosenzweig-remy")
    novelty: NoveltySettings = NoveltySettings()
    archive: ArchiveSettings = ArchiveSettings()
    on: SerializeAsAny[Platform] = Field(
        default_factory=JyroPlatform,
        description="The settings of the platform, `[platform.NAME]`.",
        json_schema_extra={"hidden": True},
    )

    @classmethod
    def table_of(cls, name: str) -> type[BaseModel] | None:
        """Return the settings of the platform of this name."""
        return platform_class(name) if name in platform_names() else None

    @model_validator(mode="wrap")
    @classmethod
    def _platform_has_its_settings(cls, values: Any, validate: ModelWrapValidatorHandler[Self]) -> Self:
        """Make `on` of the table that is named like the platform; its mistakes are reported with all others."""
        if not isinstance(values, dict):
            return validate(values)
        if "on" in values:
            return validate(_with_platform_of(values))
        spec = str(values.get("platform", "jyro"))
        name, colon, rest = spec.partition(":")
        if name not in platform_names() or not (model := platform_class(name)).is_for_studies:
            return validate(values)  # which the field's own check reports
        for other in set(values) & set(platform_names()) - {name}:
            raise ValueError(f"{other}: of no meaning here, the condition's platform is {name!r}")
        values = {"noise": model.default_noise, **values, "platform": name}
        table = values.pop(name, {})
        if colon and not (rest and model.rest_setting):
            raise ValueError(f"platform is {spec!r}, expected {' or '.join(model.specs())}")
        if colon and isinstance(table, Mapping):
            table = {**table, model.rest_setting: rest}
        elif colon:
            raise ValueError(
                f"platform is {spec!r}, expected {name!r} where its settings are given as {shown(table)}"
            )
        lines: list[InitErrorDetails] = []
        try:
            values["on"] = model.model_validate(table).identified()
        except ValidationError as error:
            lines = _lines(error, (name,))
        try:
            made = validate(values)
        except ValidationError as error:
            if not lines:
                raise
            lines = [line for line in _lines(error, ()) if line["loc"]] + lines
        else:
            if not lines:
                return made
        raise ValidationError.from_exception_data(name, lines)

    @field_validator("platform")
    @classmethod
    def _is_a_platform(cls, platform: str) -> str:
        if platform not in platform_names() or not platform_class(platform).is_for_studies:
            name = platform.partition(":")[0]
            if name == PYTHON:
                raise ValueError(
                    "expected the platform of an installed package, so that others can repeat the study"
                )
            raise ValueError(
                f"there is no such platform for studies. {did_you_mean(name, study_platforms())}"
            )
        return platform

    @model_validator(mode="before")
    @classmethod
    def _coverage_is_the_fitness_of_its_task(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        task = values.get("task", {})
        is_coverage = isinstance(task, CoverageTask) or (
            isinstance(task, Mapping) and task.get("kind", "coverage") == "coverage"
        )
        if is_coverage:
            return {**values, "selection": "coverage"} if values.get("selection") == "fitness" else values
        return {"selection": "fitness", **values}

    @model_validator(mode="after")
    def _selection_goes_with_the_task(self) -> Self:
        if self.coverage is not None:
            return self
        if self.selection == "coverage":
            raise ValueError(
                f"selection is 'coverage', which is another task than {self.task_of_trials.name!r}, expected "
                "'fitness', 'novelty' or 'random'"
            )
        if self.is_physical and self.selection == "novelty":
            raise ValueError(
                f"selection is 'novelty' with task {self.task_of_trials.name!r}, expected 'fitness' with "
                f"platform {self.platform!r}: no observer counts the cells of its trials."
            )
        return self

    @model_validator(mode="after")
    def _its_readings_take_the_noise(self) -> Self:
        self.on.check_noise(self.noise)
        return self

    @model_validator(mode="after")
    def _an_operator_can_score_it(self) -> Self:
        if self.is_physical and self.counted_cells != "line":
            raise ValueError(
                f"task.cells is 'ends', expected 'line' with platform {self.platform!r}: the paper shows the "
                "driven line, not the ends of steps."
            )
        return self

    @model_validator(mode="after")
    def _the_distance_can_be_told(self) -> Self:
        distance = DISTANCES[self.novelty.distance]
        if self.selection != "novelty":
            return self
        if self.is_physical and (distance.needs_order or distance.compares != "cells"):
            what = "their order" if distance.needs_order else "where the trial ended"
            raise ValueError(
                f"novelty.distance is {distance.name!r}, expected 'paper', 'jaccard' or 'hamming' with platform "
                f"{self.platform!r}: an operator enters the visited squares, and not {what}."
            )
        if distance.needs_order and self.counted_cells != "line":
            raise ValueError(
                f"novelty.distance is {distance.name!r}, which needs the order of visits, expected task.cells "
                "'line': the order of the cells at the ends of steps is not recorded."
            )
        return self

    @model_validator(mode="after")
    def _inputs_are_declared_once(self) -> Self:
        names = ("inputs", "bias_input") if self.coverage is not None else ("inputs",)
        fields = type(self.task).model_fields
        twice = [name for name in names if getattr(self.task, name) != fields[name].default]
        if self.controller.inputs and twice:
            raise ValueError(
                f"task.{twice[0]} and controller.inputs both define the inputs of networks. Leave "
                f"task.{twice[0]} out: controller.inputs names every input, bias included"
            )
        return self

    @model_validator(mode="after")
    def _several_robots_can_be_scored(self) -> Self:
        robots, population = self.arena.robots, self.neat.population
        starts, is_team = len(self.arena.other_starts), self.arena.networks == "each"
        if starts not in (0, robots - 1):
            raise ValueError(
                f"arena.other_starts has {starts} starts, expected {robots - 1} with arena.robots = {robots}"
            )
        if robots == 1:
            if is_team:
                raise ValueError(
                    "arena.networks is 'each', which is only for several robots. Set arena.robots"
                )
            return self
        if self.records_behavior:
            raise ValueError(
                f"novelty.distance is {self.novelty.distance!r}, which compares where one robot ends, expected one "
                f"that compares cells with arena.robots = {robots}"
            )
        if is_team and self.selection == "novelty":
            raise ValueError(
                "arena.networks is 'each', expected 'one' with selection 'novelty': cells are those of all robots"
            )
        if not (robots if is_team else 1) <= population <= MOST_TEAMS:
            raise ValueError(
                f"neat.population is {population:,}, expected {robots} to {MOST_TEAMS:,} with arena.robots = {robots}"
            )
        return self

    @model_validator(mode="after")
    def _an_archive_can_be_filled(self) -> Self:
        if self.selection != "map-elites":
            return self
        if self.is_physical:
            raise ValueError(
                f"selection is 'map-elites', expected another one with platform {self.platform!r}: it takes "
                "thousands of trials. Simulate it, and try its elites on the robot"
            )
        if self.arena.robots > 1:
            raise ValueError(
                f"selection is 'map-elites', expected another one with arena.robots = {self.arena.robots}: a trial "
                "of several robots has no descriptor"
            )
        return self

    @model_validator(mode="after")
    def _robot_and_arena_have_what_networks_see(self) -> Self:
        self.on.check_robots(self.arena.arena())
        self.on.check(self.arena.arena(), self.network_inputs, self.noise)
        self.on.check_starts(self.placed_arena)
        return self

    @model_validator(mode="after")
    def _a_run_fits_into_memory(self) -> Self:
        n_trials = self.neat.population * self.neat.generations
        if n_trials > MOST_TRIALS:
            raise ValueError(
                f"population {self.neat.population:,} x generations {self.neat.generations:,} are {n_trials:,} "
                f"trials a run, expected at most {MOST_TRIALS:,}: a run stays in memory until it is written"
            )
        return self

    @property
    def label(self) -> str:
        """Label on every figure, such as SIM. For a robot, the ledger records whether it is EMULATED or REAL."""
        return self.on.label

    @property
    def is_physical(self) -> bool:
        """True if a robot drives its trials and their scores go to a ledger."""
        return self.on.is_physical

    @property
    def key(self) -> int:
        """The key of its random numbers."""
        return random_key(self.seed, None if self.pair else self.name)

    @property
    def coverage(self) -> CoverageTask | None:
        """Its task if that is coverage; otherwise None."""
        return self.task if isinstance(self.task, CoverageTask) else None

    @property
    def task_of_trials(self) -> Task:
        """Its task, as an object that scores trials."""
        if not isinstance(self.task, Task):
            raise TypeError(f"The task is {self.task!r}, which is no `Task`.")
        return self.task

    @property
    def drawn_names(self) -> tuple[str, ...]:
        """Dotted names of the numbers that are drawn for its trials, in the order in which records have them."""
        return self.on.drawn_names(self.arena.arena(), self.network_inputs, self.noise)

    @property
    def placed_arena(self) -> Arena:
        """Its arena with the numbers that its platform's settings give. A drawn number has its center."""
        arena = self.arena.arena()
        changed = self.on.arena_numbers
        return arena.with_numbers(changed) if changed else arena

    def arena_of(self, trial: Trajectory) -> Arena:
        """Return its arena with the numbers that were drawn for a trial."""
        drawn = dict(zip(trial.drawn_names, trial.drawn, strict=True))
        changed = {name: value for name, value in drawn.items() if name.startswith("arena.")}
        return self.placed_arena.with_numbers(changed) if changed else self.placed_arena

    @property
    def repeats(self) -> int:
        """Number of trials of each individual."""
        return self.archive.repeats if self.selection == "map-elites" else 1

    @property
    def descriptor_names(self) -> tuple[str, ...]:
        """Names of the numbers that describe its trials; none unless selection is map-elites."""
        return self.archive.names if self.selection == "map-elites" else ()

    @property
    def functions(self) -> tuple[PythonFunction, ...]:
        """Functions of Python files: of the task, and of the archive, which a transfer may fill if the run does not."""
        return tuple(each for each in (self.task, self.archive.own) if isinstance(each, PythonFunction))

    def allowed(self) -> Self:
        """Return the condition with the permission to run its functions of Python files."""
        changed: dict[str, Any] = {}
        if isinstance(self.task, PythonTask):
            changed["task"] = self.task.allowed()
        if self.archive.own is not None:
            changed["archive"] = self.archive.model_copy(update={"own": self.archive.own.allowed()})
        return self.model_copy(update=changed)

    @property
    def retries_elites(self) -> bool:
        """True if its rows tell how often each genome was tried."""
        return self.selection == "map-elites" and self.archive.retry > 0

    @property
    def records_behavior(self) -> bool:
        """True if its distance of behaviors compares final positions, which need their own column."""
        return self.selection == "novelty" and DISTANCES[self.novelty.distance].compares != "cells"

    @property
    def counted_cells(self) -> Literal["line", "ends"]:
        """Kind of the cells that count as a behavior, and as coverage."""
        return "line" if self.coverage is None else self.coverage.cells

    @property
    def genome_columns(self) -> tuple[str, ...]:
        """Columns of its rows that hold the genomes of a trial."""
        return ("genome", "partners") if self.arena.networks == "each" else ("genome",)

    @property
    def network_inputs(self) -> tuple[str, ...]:
        """Names of the inputs of its networks, in order."""
        if self.controller.inputs:
            return self.controller.inputs
        if self.coverage is None:
            return tuple(self.task_of_trials.inputs)
        return self.coverage.input_names(self.selection)

    @property
    def has_bias_input(self) -> bool:
        """True if its networks have the constant input."""
        return "bias" in self.network_inputs

    @property
    def neat_rules(self) -> NeatRules:
        """Its NEAT in the form that kernels read."""
        inputs = self.network_inputs
        bias_input = inputs.index("bias") if "bias" in inputs else -1
        wheels = self.output_names == ("left", "right")
        return self.neat.rules(len(inputs), 2, bias_input=bias_input, drives_wheels=wheels)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of what its networks answer, in order."""
        return self.controller.outputs

    def settings(self) -> dict[str, Any]:
        """Return all values that determine its results, as plain values. Its name counts if seeds are not paired."""
        return self.model_dump(mode="json", exclude={"name"})

    @model_serializer(mode="wrap")
    def _with_the_table_of_its_platform(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        values[self.platform] = values.pop("on")
        if not values["controller"]:
            del values["controller"]
        if self.selection != "map-elites":  # as older conditions, whose hashes stay
            del values["archive"]
        return values

    def hash(self) -> str:
        """Return a hash of `settings` and, if random numbers depend on it, the name."""
        counted: dict[str, Any] = self.settings()
        if not self.pair:
            counted["name"] = self.name
        if self.on.version:
            counted["version"] = self.on.version
        text = json.dumps(counted, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    @classmethod
    def from_settings(cls, name: str, settings: dict[str, Any]) -> Condition:
        """Return the condition that `settings` described.

        Raises:
            RecordVersionError: They are not the settings of this version: one is missing, unknown or out of its
                range. None is filled in: a default of today may not be what the study was run with.
        """
        platform = str(settings.get("platform"))
        if "platform" in settings and platform not in platform_names():
            raise RecordVersionError(
                f"Condition {name!r} is on platform {platform!r}, which is not installed. Install the package that "
                "adds it."
            )
        try:
            condition = cls.model_validate({"name": name, **settings})
        except ValidationError as error:
            lines = [f"{place}: {text}" for place, text in mistakes(error, cls, settings)]
        else:
            lines = [f"{place} is missing." for place in _missing(settings, condition.settings())]
        if lines:
            more = f" and {len(lines) - 3} more" if len(lines) > 3 else ""
            raise RecordVersionError(
                f"This realitygap ({__version__}) cannot read the settings of condition {name!r} "
                f"({' '.join(lines[:3])}{more}). Use the version that ran the study."
            )
        return condition


def _with_platform_of(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values of a condition that is made with a platform, `on`, instead of a name."""
    on = values["on"]
    if not isinstance(on, Platform):
        raise ValueError(f"on: expected a platform with its settings, such as SimPlatform(), got {shown(on)}")
    name = getattr(type(on), "name", None)
    if values.get("platform", name) != name:
        raise ValueError(f"platform is {values['platform']!r}, expected {name!r}, which `on` is")
    if name in platform_names() and type(on) is not platform_class(str(name)):
        raise ValueError(
            f"on: expected {platform_class(str(name)).__name__} for {name!r}, got {type(on).__name__}"
        )
    return {"platform": name, "noise": on.default_noise, **values}


def _lines(error: ValidationError, within: tuple[str, ...]) -> list[InitErrorDetails]:
    """Return the mistakes of an error, with the name of their table in front of their places."""
    return [
        {
            "type": detail["type"],
            "loc": (*within, *detail["loc"]),
            "input": detail["input"],
            "ctx": detail.get("ctx", {}),
        }
        for detail in error.errors()
    ]


def _missing(given: Mapping[str, Any], full: Mapping[str, Any], place: str = "") -> Iterator[str]:
    """Yield the settings, and those within them, that are not given."""
    for key, value in full.items():
        if key not in given:
            yield place + key
        elif isinstance(value, Mapping) and isinstance(given[key], Mapping):
            yield from _missing(given[key], value, f"{place}{key}.")
