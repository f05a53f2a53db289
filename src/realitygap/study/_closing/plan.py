"""The study `closing-the-gap`: its plans, fixed before they run."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import TypeAdapter, ValidationError

from realitygap.errors import RecordError, StudyError, did_you_mean
from realitygap.orders import ClosingOrder
from realitygap.records import CALIBRATES, Observe, read_object, refuse_links, refuse_links_in, write_whole
from realitygap.robots.twin import FAMILIES

NAME = ClosingOrder.command

CONTROLLERS_SEED = 20_250_101
"""Seed of the held-out controllers of twins. No other evolution and no calibration uses it."""


class TwinName(NamedTuple):
    """A twin of the study, or a robot of another platform in one sitting.

    Attributes:
        family: Family of the twin, or name of the platform in the plan.
        seed: Seed of the twin; number of the sitting.
    """

    family: str
    seed: int

    def __str__(self) -> str:
        return f"{self.family}-{self.seed}"


@dataclass(frozen=True)
class ClosingPlan:
    """The plan of the study: twins, budgets, and trials.

    Attributes:
        study: Study whose first condition on `sim` is evolved, the paper's objective search on a robot.
        families: Families of twins: `close` is hardly wrong, and three have the most common faults of robots: motors,
            friction and time. Or names of `platforms`.
        platforms: Platforms that take the place of families of twins, by family, as users name them.
        unseen: Pairs of a family and what cannot be seen of its robots.
        fewer: Numbers of twins of the families that have fewer than the others, by family.
        twins: Number of twins of each family.
        first_seed: Seed of the first twin in each family. Results on seeds 1000 to 1009 were published while the
            methods changed, so these twins are not unseen.
        budgets: Trials on the twin for calibrating; 0 is the simulator as it is.
        observations: Observation levels of these trials.
        controllers: Held out: half of them random, half champions of runs of their own.
        trials: Trials of each of them, in simulation and on the twin.
        transfer_budget: Trials on the twin for each strategy of transfer; half of them calibrate for `posterior`, which
            chooses by the others.
        replicates: Replicates of each transfer, each with its own evolution.
        fresh_trials: Trials that judge the choice of a strategy.
        runs: Evolutions in simulation of each replicate.
        repeats: Trials of each individual in simulation.
        effort: Amount of simulation for a calibration.
        numbers: The numbers of a calibration by which it is judged.
        seed: Seed of all random numbers.
        controllers_seed: Seed of the held-out controllers.
        has_own_controllers: Whether each twin has held-out controllers of its own. Otherwise all twins share them.
        transfers: Whether what evolves is transferred to the twins.
    """

    study: str = "sim-paper"
    families: tuple[str, ...] = ("close", "worn", "slippery", "delayed")
    twins: int = 10
    first_seed: int = 1000
    budgets: tuple[int, ...] = (0, 10, 20, 40)
    observations: tuple[Observe, ...] = ("cells", "track")
    controllers: int = 30
    trials: int = 20
    transfer_budget: int = 20
    replicates: int = 3
    fresh_trials: int = 20
    runs: int = 100
    repeats: int = 8
    effort: Literal["small", "full"] = "small"
    numbers: Literal["posterior", "recommended"] = "posterior"
    seed: int = 1
    platforms: dict[str, str] = field(default_factory=dict)
    unseen: tuple[tuple[str, Observe], ...] = ()
    fewer: dict[str, int] = field(default_factory=dict)
    controllers_seed: int = CONTROLLERS_SEED
    has_own_controllers: bool = False
    transfers: bool = True

    @property
    def names(self) -> list[TwinName]:
        """All twins, those of all families by turns, so that whatever is done first is of all of them."""
        return [
            TwinName(family, self.first_seed + k)
            for k in range(self.twins)
            for family in self.families
            if k < self.fewer.get(family, self.twins)
        ]

    @property
    def n_units(self) -> int:
        """Total number of files of results."""
        return sum(1 for name in self.names for _ in self.units(name))

    def units(self, name: TwinName) -> Iterator[str]:
        """Yield what is done with a twin, in this order; each is a file when it is done."""
        yield "judged"
        yield "gap-none-0"
        costly = sorted(budget for budget in self.budgets if budget)
        # what the goals are about first
        for budget in sorted(costly, key=lambda each: each != self.transfer_budget):
            for observe in self.observations:
                if (name.family, observe) not in self.unseen:
                    yield f"gap-{observe}-{budget}"
        if self.transfers:
            yield "transfer"

    def seed_of_controllers(self, name: TwinName) -> int:
        """Return the seed of the held-out controllers of a twin."""
        return self.controllers_seed + (name.seed if self.has_own_controllers else 0)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        found: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return found


_FEW: dict[str, Any] = {
    "twins": 1,
    "first_seed": 1,
    "budgets": (0, 10),
    "controllers": 8,
    "trials": 4,
    "replicates": 1,
    "fresh_trials": 4,
    "runs": 20,
    "repeats": 4,
}

TWINS = ClosingPlan()
"""The plan at its full size, which takes hours."""

SMALL = replace(TWINS, families=("worn", "delayed"), **_FEW)
"""A plan that takes minutes. It shows that everything works, and nothing else."""

THYMIO = ClosingPlan(
    study="sim-thymio",
    families=("enki", "playground"),
    platforms={"enki": "enki", "playground": "thymio:emulator://playground?speed=8"},
    unseen=(("playground", "encoders"),),
    fewer={"playground": 1},  # it runs at most eight times as fast as a robot
    twins=8,
    first_seed=21,
    observations=("track", "encoders"),
    trials=10,
    numbers="recommended",
    controllers_seed=2026112700,
    has_own_controllers=True,
    transfers=False,
)
"""The same question for simulators that we did not write: a Thymio in Enki, and in Aseba's playground."""

FRESH = replace(
    TWINS,
    twins=6,
    first_seed=5000,
    budgets=(0, 20),
    controllers_seed=2026112800,
    has_own_controllers=True,
    transfers=False,
)
"""The same goals, without transfer, on other twins. Each seed has its own held-out controllers.

The methods were fixed before any of these twins was drawn.
"""

PLAYGROUND = replace(
    THYMIO,
    study="sim-thymio-playground",
    families=("playground",),
    platforms={"playground": THYMIO.platforms["playground"]},
    twins=1,
    first_seed=31,
    observations=("track",),
    fewer={},
    controllers_seed=2026112900,
)
"""A Thymio in Aseba's playground, from a robot file that has its infrared sensors."""

PLANS = {
    "twins": (TWINS, SMALL),
    "fresh": (FRESH, replace(FRESH, families=SMALL.families, controllers_seed=1, **_FEW)),
    "thymio": (THYMIO, replace(THYMIO, families=("enki",), controllers_seed=1, **_FEW)),
    "playground": (PLAYGROUND, replace(PLAYGROUND, controllers_seed=1, **_FEW)),
}
"""The plans by name: at full size, and small."""


def plan_of(order: ClosingOrder) -> ClosingPlan:
    """Return the plan of an order.

    Raises:
        StudyError: There is no such family or observation level.
    """
    base = PLANS[order.plan][1 if order.small else 0]
    changes: dict[str, Any] = {}
    if order.twins is not None:
        changes["twins"] = order.twins
    if order.seed is not None:
        changes["seed"] = order.seed
    if order.families is not None:
        changes["families"] = _listed(order.families, "--families", base.platforms or FAMILIES)
    if order.observe is not None:
        changes["observations"] = _listed(order.observe, "--observe", CALIBRATES)
    if order.budgets is not None:
        changes["budgets"] = tuple(sorted({0, *map(int, order.budgets.split(","))}))
    return replace(base, **changes)


def _listed(text: str, option: str, known: Collection[str]) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(word.strip() for word in text.split(",")))
    for name in names:
        if name not in known:
            raise StudyError(f"{option}: unknown {name!r}. {did_you_mean(name, known)}")
    return names


EXTENDED = ("families", "twins", "budgets")
"""Parts of a plan that may differ between calls on one folder."""


_PARTS = ("twins", "units", "calibrations", "transfers")
"""Folders in that of the study."""

_LATER = (
    "study",
    "platforms",
    "unseen",
    "fewer",
    "controllers_seed",
    "has_own_controllers",
    "transfers",
    "numbers",
)
"""Fields that are missing from folders written before there were such fields."""


def adopt_plan(folder: Path, plan: ClosingPlan) -> None:
    """Make a folder that of a plan, or see that it is.

    Raises:
        RecordError: It belongs to another plan.
    """
    path = folder / "plan.json"
    refuse_links(folder, path, *(folder / name for name in ("summary.json", "report.html")))
    refuse_links_in(folder, *_PARTS)
    if path.exists():
        stored = _stored(path)
        now = plan.to_dict()
        different = [name for name in now if name not in EXTENDED and stored.get(name) != now[name]]
        if different:
            shown = "; ".join(f"{name} was {stored.get(name)}, is {now[name]}" for name in different)
            raise RecordError(
                f"{folder} holds a {NAME} of another plan ({shown}); nothing was run. Name another folder with --out."
            )
    for part in _PARTS:
        (folder / part).mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(plan.to_dict(), indent=2).encode(), within=folder)


def read_plan(folder: Path) -> ClosingPlan:
    """Return the plan of a folder.

    Raises:
        RecordError: There is none.
    """
    path = folder / "plan.json"
    if not path.exists():
        raise RecordError(f"There is no {NAME} in {folder}. Run it: realitygap {NAME} --out {folder}")
    values = _stored(path)
    try:
        known = {field.name: values[field.name] for field in fields(ClosingPlan)}
        return TypeAdapter(ClosingPlan).validate_python(known)
    except (KeyError, ValidationError) as error:
        raise RecordError(
            f"{path} is damaged: {str(error).splitlines()[0]}. Restore it from a copy."
        ) from None


def _stored(path: Path) -> dict[str, Any]:
    """Return the plan of a folder as plain values."""
    usual = TWINS.to_dict()
    return {name: usual[name] for name in _LATER} | read_object(path)
