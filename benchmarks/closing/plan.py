"""The plan of the study, its hash, and the seeds and units that follow from it."""

from __future__ import annotations

import hashlib
import subprocess
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple

from realitygap.records import Observe

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
PLAN_FILE = ROOT / "docs" / "data" / "closing-2" / "plan.toml"
COMMIT_FILE = PLAN_FILE.with_name("commit.txt")
FAMILIES = ("close", "worn", "slippery", "delayed")
"""Families that the goals are about. Twins of the others are reported apart."""

OF_EVEN_TWINS = ("npe",)
"""Arms of the twins with an even index only. The plan has them for all, but training takes 15 minutes for each."""

Fit = Literal["none", "prior", "path", "motion", "all", "outside"]


@dataclass(frozen=True)
class Arm:
    """A way to make a simulator.

    Attributes:
        name: Its name in results.
        fit: What is fitted; `outside`: the fit is read from a file.
        observe: Observation level of the trials.
        budget: Trials on the twin; 0: those of the plan.
        evolves: Whether controllers evolve in it. Otherwise it predicts only.
    """

    name: str
    fit: Fit
    observe: Observe = "track"
    budget: int = 0
    evolves: bool = True


class Twin(NamedTuple):
    """A twin of the study."""

    family: str
    index: int

    def __str__(self) -> str:
        return f"{self.family}-{self.index}"


class Unit(NamedTuple):
    """What is done with a twin in one go: its held-out controllers driven (`judged`), or one arm."""

    task: str
    what: str

    def __str__(self) -> str:
        return f"{self.task}-{self.what}"


@dataclass(frozen=True)
class Plan:
    """The plan as its file has it; `seed_of` and `units` follow from it.

    Attributes:
        digest: SHA-256 of the file.
        commit: Hash of the commit that fixed the file, or any word for a plan that is no study.
        goals: Rules of the primary goals.
    """

    digest: str
    commit: str
    twins: dict[str, int]
    arms: tuple[Arm, ...]
    tasks: dict[str, tuple[str, ...]]
    goals: dict[str, Any] = field(default_factory=dict)
    budget: int = 20
    controllers: int = 20
    trials: int = 20
    replicates: int = 3
    runs: int = 100
    repeats: int = 8
    fresh_trials: int = 20
    fresh_simulated: int = 64

    @cached_property
    def arm(self) -> dict[str, Arm]:
        """Arms by name."""
        return {arm.name: arm for arm in self.arms}

    def names(self) -> list[Twin]:
        """Return all twins, those of all families by turns, so that whatever is done first is of all of them."""
        most = max(self.twins.values())
        return [Twin(family, k) for k in range(most) for family, n in self.twins.items() if k < n]

    def units(self, twin: Twin) -> Iterator[Unit]:
        """Yield what is done with a twin, in this order."""
        yield Unit("coverage", "judged")
        for arm in self.arms:
            if arm.name not in OF_EVEN_TWINS or twin.index % 2 == 0:
                yield Unit("coverage", arm.name)
        if twin.family in FAMILIES and twin.index % 2 == 0:
            for task in self.tasks["names"]:
                yield Unit(task, "judged")
                for name in self.tasks["arms"]:
                    yield Unit(task, name)

    def seed_of(self, twin: Twin, purpose: str) -> int:
        """Return a seed, 0 to 2^31 - 1, that nobody could know before the plan was fixed."""
        text = f"{self.commit} {twin.family} {twin.index} {purpose}"
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big") >> 1


def read_plan(path: Path = PLAN_FILE) -> Plan:
    """Return the plan that was committed.

    Raises:
        SystemExit: No commit has fixed it, or another plan.
    """
    if not COMMIT_FILE.exists():
        raise SystemExit(
            f"{COMMIT_FILE} does not exist: commit the plan, and write the hash of the commit to it."
        )
    content, commit = path.read_bytes(), COMMIT_FILE.read_text().strip()
    where = path.relative_to(ROOT).as_posix()
    committed = subprocess.run(
        ["git", "show", f"{commit}:{where}"], cwd=ROOT, capture_output=True, check=False
    )
    if committed.stdout != content:
        raise SystemExit(f"Commit {commit!r} of {COMMIT_FILE} does not have this plan. Nothing was run.")
    return parse_plan(content, commit)


def parse_plan(content: bytes, commit: str) -> Plan:
    """Return the plan in a file that a commit fixed."""
    values = tomllib.loads(content.decode())
    return Plan(
        digest=hashlib.sha256(content).hexdigest(),
        commit=commit,
        twins=values["twins"],
        arms=tuple(Arm(**arm) for arm in values["arm"]),
        tasks={name: tuple(each) for name, each in values["tasks"].items()},
        goals=values["primary"],
        **{name: values[name] for name in NUMBERS},
    )


@cache
def code_digest() -> str:
    """Return the SHA-256 of the package and of the study, which each result holds."""
    found = hashlib.sha256()
    for folder in (ROOT / "src" / "realitygap", HERE):
        for path in sorted(folder.rglob("*.py")):
            found.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()


NUMBERS = (
    "budget", "controllers", "trials", "replicates", "runs", "repeats", "fresh_trials", "fresh_simulated",
)  # fmt: skip


def small_plan() -> Plan:
    """Return a plan for two other twins, without the arms of other budgets. It only shows that everything works."""
    content = PLAN_FILE.read_bytes()
    values = tomllib.loads(content.decode())
    arms = tuple(Arm(**arm) for arm in values["arm"] if "budget" not in arm)
    whole = Plan(
        digest="small",
        commit="small",
        twins={"close": 1, "alien": 1},
        arms=arms,
        tasks={name: tuple(each) for name, each in values["tasks"].items()},
        goals=values["primary"],
    )
    few: dict[str, Any] = {"controllers": 5, "trials": 4, "replicates": 1, "runs": 10, "repeats": 2}
    return replace(whole, **few, budget=10, fresh_trials=4, fresh_simulated=8)
