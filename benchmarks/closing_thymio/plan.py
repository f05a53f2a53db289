"""The plans of the study, fixed before they ran, and the sittings and units that follow from them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from realitygap.records import Observe, read_object, write_whole


class Sitting(NamedTuple):
    """A robot in one sitting.

    Attributes:
        family: Name of the robot's platform in the plan.
        number: Number of the sitting, which is the seed of its calibrations.
    """

    family: str
    number: int

    def __str__(self) -> str:
        return f"{self.family}-{self.number}"


@dataclass(frozen=True)
class Plan:
    """The plan of the study.

    Attributes:
        study: Study whose first condition on `sim` is evolved.
        platforms: Platforms by family, as users name them.
        twins: Number of sittings with each robot.
        first_seed: Number of the first sitting.
        controllers_seed: Seed of the held-out controllers, to which the number of the sitting is added.
        fewer: Numbers of sittings of the robots that have fewer than the others.
        observations: Observation levels of calibrations.
        unseen: Pairs of a family and what cannot be seen of its robots.
        budgets: Trials for calibrating; 0 is the simulator as it is.
        judged_at: The budget that the goals are about.
        controllers: Held out: half of them random, half champions of runs of their own.
        trials: Trials of each of them, in simulation and on the robot.
        seed: Seed of the condition.
    """

    study: str
    platforms: dict[str, str]
    twins: int
    first_seed: int
    controllers_seed: int
    fewer: dict[str, int] = field(default_factory=dict)
    observations: tuple[Observe, ...] = ("track", "encoders")
    unseen: tuple[tuple[str, Observe], ...] = ()
    budgets: tuple[int, ...] = (0, 10, 20, 40)
    judged_at: int = 20
    controllers: int = 30
    trials: int = 10
    seed: int = 1

    @property
    def families(self) -> tuple[str, ...]:
        """Names of the robots."""
        return tuple(self.platforms)

    @property
    def sittings(self) -> list[Sitting]:
        """All sittings, those of all robots by turns, so that whatever is done first is of all of them."""
        return [
            Sitting(family, self.first_seed + k)
            for k in range(self.twins)
            for family in self.families
            if k < self.fewer.get(family, self.twins)
        ]

    def units(self, sitting: Sitting) -> Iterator[str]:
        """Yield what is done in a sitting, in this order; each is a file when it is done."""
        yield "judged"
        yield "gap-none-0"
        for budget in sorted(filter(None, self.budgets), key=lambda each: each != self.judged_at):
            for observe in self.observations:
                if (sitting.family, observe) not in self.unseen:
                    yield f"gap-{observe}-{budget}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        values: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return values | {"families": list(self.families)}


PLAYGROUND_PORT = "thymio:emulator://playground?speed=8"
"""It runs at most eight times as fast as a robot."""

THYMIO = Plan(
    study="sim-thymio",
    platforms={"enki": "enki", "playground": PLAYGROUND_PORT},
    twins=8,
    first_seed=21,
    controllers_seed=2026112700,
    fewer={"playground": 1},
    unseen=(("playground", "encoders"),),
)

PLAYGROUND = Plan(
    study="sim-thymio-playground",
    platforms={"playground": PLAYGROUND_PORT},
    twins=1,
    first_seed=31,
    controllers_seed=2026112900,
    observations=("track",),
)
"""A Thymio in Aseba's playground, from a robot file that has its infrared sensors."""

PLANS = {"thymio": THYMIO, "playground": PLAYGROUND}


def small(plan: Plan) -> Plan:
    """Return a plan of one sitting with the first robot. It takes minutes, and shows only that everything works."""
    family = plan.families[0]
    return replace(
        plan, platforms={family: plan.platforms[family]}, twins=1, first_seed=1, controllers_seed=1,
        budgets=(0, 10), judged_at=10, controllers=8, trials=4,
    )  # fmt: skip


def adopt_plan(folder: Path, plan: Plan) -> None:
    """Write the plan to its folder, or see that it is there.

    Raises:
        SystemExit: The folder is of another plan.
    """
    path = folder / "plan.json"
    now = plan.to_dict()
    if path.exists():
        stored = read_object(path)
        different = [name for name in now if name != "families" and stored.get(name) != now[name]]
        if different:
            raise SystemExit(f"{folder} is of another plan ({', '.join(different)} differ). Nothing was run.")
        return
    for part in ("units", "calibrations"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(now, indent=2).encode(), within=folder)


def read_plan(folder: Path) -> Plan:
    """Return the plan of a folder.

    Raises:
        SystemExit: There is none.
    """
    path = folder / "plan.json"
    if not path.exists():
        raise SystemExit(
            f"There are no results in {folder}. Make them: python -m benchmarks.closing_thymio run {folder}"
        )
    values = read_object(path)
    del values["families"]
    values |= {name: tuple(values[name]) for name in ("observations", "budgets")}
    return Plan(**values | {"unseen": tuple((family, observe) for family, observe in values["unseen"])})
