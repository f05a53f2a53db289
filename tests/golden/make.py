"""Digests that no refactoring may change; `python -m tests.golden.make` writes the present ones to golden.json.

A digest that differs is a defect, unless the results version went up.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.calibration import random_controllers
from realitygap.records import trial_to_dict
from realitygap.robots.twin import sample_twin
from realitygap.runs import run_replicates
from realitygap.study import load_study, named_studies, open_target, parse_study
from realitygap.trials import TrialPlan
from realitygap.world import paper_arena
from tests.study.physical import drive, scored, small_study

FILE = Path(__file__).with_name("golden.json")

TARGETS = ("jyro", "sim", "sim:khepera", "twin:{file}")

TWIN_STUDY = """
[study]
name = "on-a-twin"
[neat]
population = 4
generations = 2
[platform.twin]
steps = 15
[[condition]]
name = "same"
platform = "twin:{file}"
"""


def hashes_of_conditions() -> dict[str, str]:
    """Return one digest over the conditions' hashes of each study that comes with realitygap."""
    return {
        name: _digest([(condition.name, condition.hash()) for condition in load_study(name).conditions])
        for name in named_studies()
    }


def results() -> dict[str, Callable[[], str]]:
    """Return what computes each digest of results."""
    studies = {f"run {name}": partial(_study, name) for name in ("paper", "sim-paper", "avoid", "light")}
    return (
        studies
        | {
            "run twin": _twin_study,
            "run scribbler": _physical_study,
        }
        | {f"trials {spec}": partial(_trials, spec) for spec in TARGETS}
    )


def _digest(values: Any) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True, default=str).encode()).hexdigest()[:16]


def _study(name: str) -> str:
    """Return a digest of two replicates of three generations of each condition."""
    rows = []
    for condition in load_study(name).conditions:
        neat = condition.neat.model_copy(update={"population": 20, "generations": 3})
        frame = run_replicates(condition.model_copy(update={"neat": neat}), 0, 2)
        rows.append((condition.name, frame.drop("key").rows()))
    return _digest(rows)


def _twin_study() -> str:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "same.toml"
        file.write_text(sample_twin("same", 3).to_toml())  # `sim` itself, which needs no MuJoCo
        frame = run_replicates(parse_study(TWIN_STUDY.format(file=file), "twin.toml").conditions[0], 0, 1)
    return _digest(frame.rows())


def _physical_study() -> str:
    with tempfile.TemporaryDirectory() as folder:
        drive(small_study(), Path(folder) / "small")
        return _digest(scored(Path(folder) / "small"))


def _trials(spec: str) -> str:
    """Return a digest of trials of two controllers and of commands, with all that can be seen of them."""
    commands = np.array([[0.5, 0.1], [1.0, -0.4], [-0.3, 0.8], [0.9, 0.0]])
    plans = [
        *(TrialPlan(genome=genome, steps=12, number=k) for k, genome in enumerate(random_controllers(2, 5))),
        TrialPlan(commands=commands, number=7, purpose="motion"),
    ]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "same.toml"
        file.write_text(sample_twin("same", 3).to_toml())
        with open_target(spec.format(file=file), paper_arena(), processes=1) as target:
            return _digest([trial_to_dict(trial) for trial in target.carry_out(plans, "track")])


def main() -> None:
    """Write the present digests."""
    golden = {
        "conditions": hashes_of_conditions(),
        "results": {name: compute() for name, compute in results().items()},
    }
    FILE.write_text(json.dumps(golden, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
