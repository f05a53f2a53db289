"""The study `closing-the-gap`: what it does, fixed before it is carried out."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import TypeAdapter, ValidationError

from realitygap.errors import RecordError
from realitygap.records import Observe, read_object, refuse_links, refuse_links_in, write_whole

NAME = "closing-the-gap"

STUDY = "sim-paper"
"""Whose first condition on `sim` is evolved: the paper's objective search on the Scribbler."""

CONTROLLERS_SEED = 20_250_101
"""Of the held-out controllers: of no other evolution and no calibration."""


class TwinName(NamedTuple):
    """A twin of the study."""

    family: str
    seed: int

    def __str__(self) -> str:
        return f"{self.family}-{self.seed}"


@dataclass(frozen=True)
class ClosingPlan:
    """What is done with how many twins.

    Attributes:
        families: Of twins: `close` for what is hardly wrong, and three for what goes wrong with robots most: motors,
            friction and time.
        twins: Of each family.
        first_seed: Of the first twin in each family. Results on seeds 1000 to 1009 were published while the methods
            changed, so these twins are not unseen.
        budgets: Trials on the twin for calibrating; 0 is the simulator as it is.
        observations: What is seen of these trials.
        controllers: Held out: half of them random, half champions of runs of their own.
        trials: Of each of them, in simulation and on the twin.
        transfer_budget: Trials on the twin for each strategy of transfer; half of them calibrate for `posterior`, which
            chooses by the others.
        replicates: Of each transfer, with evolution of their own.
        fresh_trials: By which what a strategy chose is judged.
        runs: Evolutions in simulation of each replicate.
        repeats: Trials of each individual in simulation.
        effort: How much is simulated for a calibration.
        seed: Of all random numbers.
    """

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
    seed: int = 1

    @property
    def names(self) -> list[TwinName]:
        """All twins, those of all families by turns, so that whatever is done first is of all of them."""
        seeds = range(self.first_seed, self.first_seed + self.twins)
        return [TwinName(family, seed) for seed in seeds for family in self.families]

    @property
    def n_units(self) -> int:
        """Files of results in all."""
        return len(self.names) * sum(1 for _ in self.units())

    def units(self) -> Iterator[str]:
        """What is done with each twin, in this order; each is a file when it is done."""
        yield "judged"
        yield "gap-none-0"
        costly = sorted(budget for budget in self.budgets if budget)
        # what the goals are about first
        for budget in sorted(costly, key=lambda each: each != self.transfer_budget):
            for observe in self.observations:
                yield f"gap-{observe}-{budget}"
        yield "transfer"

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        found: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return found


SMALL = ClosingPlan(
    families=("worn", "delayed"),
    twins=1,
    first_seed=1,
    budgets=(0, 10),
    controllers=8,
    trials=4,
    transfer_budget=20,
    replicates=1,
    fresh_trials=4,
    runs=20,
    repeats=4,
)
"""Minutes in place of hours; too little to say anything but that all of it works."""

EXTENDED = ("families", "twins", "budgets")
"""What may differ between calls on one folder: the rest of its plan is fixed."""


_PARTS = ("twins", "units", "calibrations", "transfers")
"""Folders in that of the study."""


def adopt_plan(folder: Path, plan: ClosingPlan) -> None:
    """Make a folder that of a plan, or see that it is.

    Raises:
        RecordError: It belongs to another plan.
    """
    path = folder / "plan.json"
    refuse_links(folder, path, *(folder / name for name in ("summary.json", "report.html")))
    refuse_links_in(folder, *_PARTS)
    if path.exists():
        there = read_object(path)
        now = plan.to_dict()
        different = [name for name in now if name not in EXTENDED and there.get(name) != now[name]]
        if different:
            shown = "; ".join(f"{name} was {there.get(name)}, is {now[name]}" for name in different)
            raise RecordError(
                f"{folder} holds a {NAME} of another plan ({shown}); nothing was run. Name another folder with --out."
            )
    for part in _PARTS:
        (folder / part).mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(plan.to_dict(), indent=2).encode(), within=folder)


def read_plan(folder: Path) -> ClosingPlan:
    """The plan of a folder.

    Raises:
        RecordError: There is none.
    """
    path = folder / "plan.json"
    if not path.exists():
        raise RecordError(f"There is no {NAME} in {folder}. Run it: realitygap {NAME} --out {folder}")
    values = read_object(path)
    try:
        known = {field.name: values[field.name] for field in fields(ClosingPlan)}
        return TypeAdapter(ClosingPlan).validate_python(known)
    except (KeyError, ValidationError) as error:
        raise RecordError(
            f"{path} is damaged: {str(error).splitlines()[0]}. Restore it from a copy."
        ) from None
