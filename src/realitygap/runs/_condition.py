"""One condition of a study, as resolved: everything that decides what a run of it does."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, SerializeAsAny, ValidationError, model_validator

from realitygap._version import __version__
from realitygap.errors import RecordVersionError
from realitygap.evolution import (
    DISTANCES,
    ControllerInterface,
    NeatSettings,
    NoveltySettings,
    inputs_of_ranges,
    random_key,
)
from realitygap.kernels._genome import NeatRules
from realitygap.robots import JyroPlatform, ScribblerPlatform, SimPlatform, TwinPlatform, hash_elsewhere
from realitygap.settings import Settings, mistakes
from realitygap.tasks import CoverageTask, Task, as_task
from realitygap.trials import Trajectory, paper_inputs, sim_scene
from realitygap.world import Arena, ArenaSettings, check_drawn_starts

# A condition's name is part of file names.
NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"

# Trials of a run: with some 600 bytes for the row of each, 3 GB.
MOST_TRIALS = 5_000_000

Selection = Literal["coverage", "fitness", "novelty", "random"]
Platform = Literal["jyro", "sim", "twin", "scribbler"]


# Platforms that may name a file, and the setting that this is.
FILE_KEYS = {"sim": "robot", "twin": "file"}


class Condition(Settings):
    """One cell of a study's design.

    Its runs are a function of these values and the number of the replicate alone.
    """

    name: str = Field(
        pattern=NAME_PATTERN, max_length=80, description="Letters, digits, dot, dash and underscore."
    )
    selection: Selection = Field(
        "coverage",
        description="What decides who has children: coverage (the paper's objective NEAT) or, with another task, "
        "fitness by it; novelty; or nothing: random tries as many unrelated networks, the control that the paper "
        "lacks.",
    )
    platform: Platform = Field(
        "jyro",
        description="What the networks are tried on: jyro, the paper's simulation; sim, a robot simulated with its "
        "outline, contact, motors and sensors (sim:FILE is one of a file); twin:FILE, pseudo-reality in MuJoCo; or "
        "scribbler, the robot.",
    )
    noise: float = Field(
        0.1,
        ge=0,
        le=10,
        description="Level a: each reading is moved by a * U(-1, 1) before the largest is taken "
        "(section 2.3: 0.1, 0.5, 0.8). On a robot or a twin 0: its readings are noisy by themselves; on sim, 0 when "
        "not given, it comes on top of the robot's own noise.",
    )
    seed: int = Field(1, ge=0, le=2**63 - 1, description="Of the study's random numbers.")
    pair: bool = Field(
        True,
        description="Whether the conditions of a study draw the same random numbers, which narrows the "
        "difference between them.",
    )
    arena: ArenaSettings = ArenaSettings()
    task: Annotated[SerializeAsAny[Settings], BeforeValidator(as_task)] = CoverageTask()
    neat: NeatSettings = NeatSettings.named("rosenzweig-remy")
    novelty: NoveltySettings = NoveltySettings()
    jyro: JyroPlatform = JyroPlatform()
    sim: SimPlatform = Field(default_factory=SimPlatform)
    twin: TwinPlatform = TwinPlatform()
    scribbler: ScribblerPlatform = ScribblerPlatform()

    @model_validator(mode="before")
    @classmethod
    def _platform_may_name_a_file(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        name, colon, file = str(values.get("platform", "")).partition(":")
        if colon and name in FILE_KEYS:
            values = {**values, "platform": name, name: {**dict(values.get(name, {})), FILE_KEYS[name]: file}}
        if name == "twin":
            values = {**values, "twin": _hashed(dict(values.get("twin", {})))}
        # a robot adds its own noise
        return {"noise": 0.0, **values} if name in ("sim", "twin", "scribbler") else values

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
                f"selection is 'coverage', which is another task than {self.fitness_task.name!r}, expected 'fitness', "
                "'novelty' or 'random'"
            )
        if self.is_physical:
            raise ValueError(
                f"task.kind is {self.fitness_task.name!r}, expected coverage with platform 'scribbler': an operator "
                "enters the visited squares, and nothing else is known of a trial."
            )
        return self

    @model_validator(mode="after")
    def _a_twin_is_noisy_by_itself(self) -> Self:
        if self.platform == "twin" and self.noise != 0:
            raise ValueError(
                f"noise is {self.noise:g}, expected none with platform 'twin': its readings are noisy by themselves. "
                "Leave it out."
            )
        return self

    @model_validator(mode="after")
    def _an_operator_can_score_it(self) -> Self:
        if self.is_physical and self.noise != 0:
            raise ValueError(
                f"noise is {self.noise:g}, expected none with platform 'scribbler': a robot's readings are noisy by "
                "themselves. Leave it out."
            )
        if self.is_physical and self.counted_cells != "line":
            raise ValueError(
                "task.cells is 'ends', expected 'line' with platform 'scribbler': on paper stands the line that was "
                "driven, and not where steps end."
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
                f"'scribbler': an operator enters the visited squares, and not {what}."
            )
        if distance.needs_order and self.counted_cells != "line":
            raise ValueError(
                f"novelty.distance is {distance.name!r}, which looks at the order of visits, expected task.cells "
                f"'line' with it: of the cells at the ends of steps no order is kept."
            )
        return self

    @model_validator(mode="after")
    def _robot_and_arena_have_what_networks_see(self) -> Self:
        if self.platform == "sim":
            sim_scene(self.sim, self.arena.arena(), self.network_inputs, self.noise)
        elif self.platform == "twin":
            there = inputs_of_ranges(len(self.twin.sensors.mounts))
            ControllerInterface(self.network_inputs).check(there, "A network", "platform 'twin'")
        elif self.coverage is None and self.network_inputs != paper_inputs(self.neat_rules):
            raise ValueError(
                f"the networks of task {self.fitness_task.name!r} see {', '.join(self.network_inputs)}, expected "
                f"{', '.join(paper_inputs(self.neat_rules))} on platform {self.platform!r}. Choose platform 'sim', or "
                "give the task these inputs."
            )
        return self

    @model_validator(mode="after")
    def _robot_fits_at_start(self) -> Self:
        if self.platform == "jyro":
            self.arena.arena().straight_walls()  # which says where there are none
        robot = self.sim.model if self.platform == "sim" else self.tried_on.body
        check_drawn_starts(self.placed_arena, robot)
        return self

    @model_validator(mode="after")
    def _a_run_fits_into_memory(self) -> Self:
        n_trials = self.neat.population * self.neat.generations
        if n_trials > MOST_TRIALS:
            raise ValueError(
                f"population {self.neat.population:,} x generations {self.neat.generations:,} are {n_trials:,} "
                f"trials a run, expected at most {MOST_TRIALS:,}: a run is held in memory until it is written"
            )
        return self

    @property
    def label(self) -> str:
        """What every figure of this condition says, SIM; of a robot the ledger knows whether EMULATED or REAL."""
        return self.tried_on.label

    @property
    def is_physical(self) -> bool:
        """Whether its trials are driven by a robot, and scored into a ledger."""
        return self.platform == "scribbler"

    @property
    def tried_on(self) -> JyroPlatform | SimPlatform | TwinPlatform | ScribblerPlatform:
        """The settings of its platform."""
        return self.scribbler if self.platform == "scribbler" else self.simulated_on

    @property
    def simulated_on(self) -> JyroPlatform | SimPlatform | TwinPlatform:
        """The settings of the platform that computes its trials."""
        if self.platform == "twin":
            return self.twin
        return self.sim if self.platform == "sim" else self.jyro

    @property
    def key(self) -> int:
        """The key of its random numbers."""
        return random_key(self.seed, None if self.pair else self.name)

    @property
    def coverage(self) -> CoverageTask | None:
        """Its task where that is coverage; None where it is another."""
        return self.task if isinstance(self.task, CoverageTask) else None

    @property
    def fitness_task(self) -> Task:
        """Its task where that is another than coverage."""
        if not isinstance(self.task, Task):
            raise TypeError(f"The task is {self.task!r}, which is no `Task`.")
        return self.task

    @property
    def drawn_names(self) -> tuple[str, ...]:
        """Dotted names of the numbers that are drawn for its trials, in the order in which records have them."""
        if self.platform != "sim":
            return ()
        return sim_scene(self.sim, self.arena.arena(), self.network_inputs, self.noise).drawn_names

    @property
    def placed_arena(self) -> Arena:
        """Its arena, with what its platform's settings say of the arena's numbers; of what is drawn, the centers."""
        arena = self.arena.arena()
        changed = self.sim.arena_numbers if self.platform == "sim" else {}
        return arena.with_numbers(changed) if changed else arena

    def arena_of(self, trial: Trajectory) -> Arena:
        """Its arena with what was drawn for a trial."""
        drawn = dict(zip(trial.drawn_names, trial.drawn, strict=True))
        changed = {name: value for name, value in drawn.items() if name.startswith("arena.")}
        return self.placed_arena.with_numbers(changed) if changed else self.placed_arena

    @property
    def records_behavior(self) -> bool:
        """Whether its distance of behaviors compares what is in no other column: where trials end."""
        return self.selection == "novelty" and DISTANCES[self.novelty.distance].compares != "cells"

    @property
    def counted_cells(self) -> Literal["line", "ends"]:
        """Which cells count as a behavior, and as coverage."""
        return "line" if self.coverage is None else self.coverage.cells

    @property
    def network_inputs(self) -> tuple[str, ...]:
        """Names of what its networks see, in order."""
        if self.coverage is None:
            return tuple(self.fitness_task.inputs)
        return self.coverage.input_names(self.selection)

    @property
    def has_bias_input(self) -> bool:
        """Whether its networks have the constant input."""
        return "bias" in self.network_inputs

    @property
    def neat_rules(self) -> NeatRules:
        """Its NEAT in the form that kernels read."""
        inputs = self.network_inputs
        bias_input = inputs.index("bias") if "bias" in inputs else -1
        return self.neat.rules(len(inputs), 2, bias_input=bias_input)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of what its networks answer, in order."""
        return ("move", "turn")

    def settings(self) -> dict[str, Any]:
        """Everything that decides its results, as plain values; its name counts only where seeds are not paired."""
        unused = {"jyro", "sim", "twin", "scribbler"} - {self.platform}
        return self.model_dump(mode="json", exclude={"name", *unused})

    def hash(self) -> str:
        """A hash of `settings` and, where random numbers depend on it, the name."""
        counted: dict[str, Any] = self.settings()
        if not self.pair:
            counted["name"] = self.name
        text = json.dumps(counted, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    @classmethod
    def from_settings(cls, name: str, settings: dict[str, Any]) -> Condition:
        """The condition that `settings` described.

        Raises:
            RecordVersionError: They are not the settings of this version: one is missing, unknown or out of its
                range. None is filled in: a default of today may not be what the study was run with.
        """
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


def _hashed(twin: dict[str, Any]) -> dict[str, Any]:
    """Settings of a twin with the hash of its file."""
    file = twin.get("file")
    if not file or not isinstance(file, str):
        raise ValueError("platform is 'twin', expected twin:FILE, with the file of the twin")
    return twin if twin.get("sha256") else {**twin, "sha256": hash_elsewhere(file)}


def _missing(given: Mapping[str, Any], full: Mapping[str, Any], place: str = "") -> Iterator[str]:
    """The settings, and those within them, that are not given."""
    for key, value in full.items():
        if key not in given:
            yield place + key
        elif isinstance(value, Mapping) and isinstance(given[key], Mapping):
            yield from _missing(given[key], value, f"{place}{key}.")
