"""Which strategy brings a damaged robot back with few trials? A study on twins, as JSON.

`python benchmarks/recovery.py run FOLDER` damages 20 twins: 4 of each of the families weak-wheel, dead-wheel,
blind-sensor, payload, and stuck-caster, with seeds from 7000 on, 100 apart by family. For each, controllers and
repertoires evolve anew for `sim`, with the seed of the twin. Each strategy of `STRATEGIES` then has 5, 10, 20, and 40
trials on the damaged twin, whose track is observed. 20 fresh trials judge its choice. The same twin without its damage
tells the intact score: the mean of 20 trials of the champion of `plain`. The command can be interrupted and run again.

`python benchmarks/recovery.py analyze FOLDER --out docs/data` writes the tables.

Goals, for a budget of 10: the best strategy of trial and error regains 80 % of the intact score in most families, in
the mean over their twins; and `trial-and-error-combined` is better than each of its parts, in the mean over all twins,
with an interval that excludes 0. Strategies with damages try their elites under each damage as well, with more trials
in simulation than the others have. A twin that fails is tried again by the next call; the tables list what is missing.
The numbers of the search were chosen on damaged robots on `sim`, and on no twin. One twin of seed 900 of each family
was looked at while the code was written. The plan was set before the first run. Between plan and first run, archives
began to try their elites again by default.

`python benchmarks/recovery.py parameters --out docs/data` shows how the numbers of the search were chosen: repertoires
for suspected damages evolve on `sim`, twice. Each is searched on 24 robots on `sim` with other numbers and a damage
that is drawn. Each row of the table is one set of numbers, with the mean score after 3, 5, 10, and 20 trials.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from realitygap.evolution import Genome
from realitygap.platforms import TwinTarget, as_sim
from realitygap.records import write_whole
from realitygap.robots.twin import TwinModel, sample_twin
from realitygap.runs import Condition
from realitygap.stats import mean_interval
from realitygap.study import choose_condition, transfer
from realitygap.study._transfer.attempt import Simulation
from realitygap.study._transfer.noise import changed_condition
from realitygap.study._transfer.repertoire import finalists, joined, tried_under
from realitygap.study._transfer.simulated import crossed_cells, try_repeatedly
from realitygap.study._transfer.trial_and_error import SearchRules, damaged_conditions, search
from realitygap.trials import NoiseKey

FAMILIES = ("weak-wheel", "dead-wheel", "blind-sensor", "payload", "stuck-caster")
FIRST_SEED, TWINS = 7000, 4
BUDGETS, BUDGET = (5, 10, 20, 40), 10
STRATEGIES = (
    "plain",
    "select",
    "direct",
    "calibrated",
    "posterior",
    "trial-and-error",
    "trial-and-error-recalibrated",
    "trial-and-error-posterior",
    "trial-and-error-damage",
    "trial-and-error-combined",
)
COMBINED = "trial-and-error-combined"
PARTS = ("plain", *(name for name in STRATEGIES if name.startswith("trial-and-error") and name != COMBINED))
RUNS, REPEATS, FRESH = 200, 4, 20
REGAINED = 0.8

REPLICATES, ROBOTS, TRIALS, JUDGED_FROM = 2, 24, 24, 12
BUDGETS_OF_PARAMETERS = (3, 5, 10, 20)
SETS = (
    SearchRules(spread=1.0, offset=0.0, kappa=0.05, unlikely=math.inf),
    SearchRules(spread=1.0, offset=0.0, unlikely=math.inf),
    SearchRules(kappa=0.05, unlikely=math.inf),
    SearchRules(kappa=0.3, unlikely=math.inf),
    SearchRules(unlikely=math.inf),
    *(
        SearchRules(spread, offset, kappa, unlikely)
        for spread, offset in ((0.05, 0.0), (0.1, 0.0), (0.1, 0.1), (0.2, 0.1))
        for kappa in (0.3, 1.0)
        for unlikely in (0.05, 0.1, 0.3)
    ),
)


class Twin(NamedTuple):
    """A twin of the study."""

    family: str
    seed: int

    def __str__(self) -> str:
        return f"{self.family}-{self.seed}"


def twins() -> Iterator[Twin]:
    """Yield all twins, those of all families by turns."""
    for k in range(TWINS):
        for family in FAMILIES:
            yield Twin(family, FIRST_SEED + 100 * FAMILIES.index(family) + k)


def mended(model: TwinModel) -> TwinModel:
    """Return a damaged twin with what `close` twins have in the middle in place of the damage."""
    motors, ir = model.motors, model.ir
    return model.model_copy(
        update={
            "name": f"{model.name}-mended",
            "motors": motors.model_copy(
                update={
                    "gain_left": max(motors.gain_left, 0.98),
                    "gain_right": max(motors.gain_right, 0.98),
                    "speed": max(motors.speed, 0.145),
                    "lag": min(motors.lag, 0.06),
                }
            ),
            "ir": ir.model_copy(
                update={"mount": tuple(each.model_copy(update={"gain": 1.0}) for each in ir.mount)}
            ),
            "body": model.body.model_copy(
                update={"mass": min(model.body.mass, 1.0), "center": max(model.body.center, 0.008)}
            ),
            "wheels": model.wheels.model_copy(update={"caster_friction": 0.0}),
        }
    )


def carry_out(twin: Twin, folder: Path, budgets: tuple[int, ...] = BUDGETS) -> None:
    """Compute what is missing of a twin."""
    done = folder / f"{twin}.json"
    if done.exists():
        return
    damaged = sample_twin(twin.family, twin.seed)
    scores: dict[str, Any] = {"family": twin.family, "seed": twin.seed, "label": "TWIN"}
    arena = choose_condition("sim-paper", "coverage-sim", 1).arena.arena()
    options = {"condition": "coverage-sim", "observe": "track", "runs": RUNS, "repeats": REPEATS}
    options |= {"fresh_trials": FRESH, "seed": twin.seed}
    for what, model, strategies in (
        ("damaged", damaged, STRATEGIES),
        ("intact", mended(damaged), ("plain",)),
    ):
        file = folder / "twins" / f"{twin}-{what}.toml"
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, model.to_toml().encode(), within=folder)
        with TwinTarget(str(file), arena, 1, name=f"twin:{twin}-{what}") as target:
            found = transfer(
                "sim-paper",
                target,
                strategies,
                budgets,
                out=folder / "transfers" / f"{twin}-{what}",
                **options,
            )
        scores[what] = [
            {"strategy": each.strategy, "budget": each.budget, "scores": list(each.scores)}
            for each in found.champions
        ]
    write_whole(done, json.dumps(scores).encode(), within=folder)


def run(folder: Path, processes: int) -> None:
    """Carry out what is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    left = [twin for twin in twins() if not (folder / f"{twin}.json").exists()]
    print(f"{len(left)} of {len(list(twins()))} twins are not done.", flush=True)
    with ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        jobs = {pool.submit(carry_out, twin, folder): twin for twin in left}
        try:
            for job in as_completed(jobs):
                error = job.exception()
                print(f"{jobs[job]}: {'done' if error is None else error}", flush=True)
        except BaseException:  # else Ctrl-C would wait for all other jobs
            for child in multiprocessing.active_children():
                child.terminate()
            raise


def analyze(folder: Path) -> dict[str, Any]:
    """Return means and paired differences over the twins that are done."""
    rows = [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]
    if not rows:
        raise SystemExit(
            f"{folder} has no twin that is done. Run: python benchmarks/recovery.py run {folder}"
        )
    intact = np.array([np.mean(row["intact"][0]["scores"]) for row in rows])
    families = np.array([row["family"] for row in rows])
    score: dict[tuple[str, int], Any] = {}
    for k, row in enumerate(rows):
        for each in row["damaged"]:
            of_twins = score.setdefault((each["strategy"], each["budget"]), np.full(len(rows), np.nan))
            of_twins[k] = np.mean(each["scores"])
    table: list[dict[str, Any]] = [
        {
            "strategy": strategy,
            "budget": budget,
            "score": mean_interval(values).to_dict(),
            "of_intact": {
                family: float(np.mean(values[families == family] / intact[families == family]))
                for family in FAMILIES
                if (families == family).any()
            },
        }
        for (strategy, budget), values in score.items()
    ]
    combined = score[COMBINED, BUDGET]
    differences = {part: mean_interval(combined - score[part, BUDGET]).to_dict() for part in PARTS}
    best = max(
        (row for row in table if row["budget"] == BUDGET and row["strategy"].startswith("trial")),
        key=lambda row: row["score"]["estimate"],
    )
    regained = sum(share >= REGAINED for share in best["of_intact"].values())
    each_twin = [
        {
            "family": row["family"],
            "seed": row["seed"],
            "intact": whole,
            "scores": [
                {"strategy": strategy, "budget": budget, "score": values[k]}
                for (strategy, budget), values in score.items()
            ],
        }
        for k, (row, whole) in enumerate(zip(rows, intact.tolist(), strict=True))
    ]
    return {
        "label": "TWIN",
        "twins": each_twin,
        "missing": [str(twin) for twin in twins() if not (folder / f"{twin}.json").exists()],
        "intact": mean_interval(intact).to_dict(),
        "table": table,
        "combined_minus_part": differences,
        "best": best["strategy"],
        "families_that_regain": regained,
        "goal_regained": regained > len(FAMILIES) / 2,
        "goal_combined": all(each["low"] > 0 for each in differences.values()),
    }


class Recorded:
    """What `search` needs of an attempt: trials on a robot on `sim` that were simulated before."""

    stop_at = None

    def __init__(
        self, condition: Condition, genomes: list[Genome], crossed: Any, scores: Any, budget: int
    ) -> None:
        self.condition, self.left = condition, budget
        self.crossed, self.scores = crossed, scores
        self._place = {id(genome): k for k, genome in enumerate(genomes)}
        self._tried = np.zeros(len(genomes), int)

    def try_on_target(self, genomes: list[Genome]) -> tuple[list[float], list[tuple[int, ...]]]:
        """Return the next trial of one genome."""
        k = self._place[id(genomes[0])]
        which = self._tried[k] % JUDGED_FROM
        self._tried[k] += 1
        self.left -= 1
        return [float(self.scores[k, which])], [tuple(np.nonzero(self.crossed[k, which])[0].tolist())]


def drawn_robot(random: np.random.Generator, numbers: dict[str, float]) -> dict[str, float]:
    """Return numbers of a robot that is a little unlike its file, and has a damage."""
    drawn = {
        "drive.gain_left": random.uniform(0.9, 1.05),
        "drive.gain_right": random.uniform(0.9, 1.05),
        "drive.delay": random.uniform(0.0, 0.12),
        "drive.lag": random.uniform(0.05, 0.15),
        "drive.drift_per_m": random.uniform(-0.2, 0.2),
        "contact.friction": random.uniform(0.15, 0.5),
    }
    drawn |= {f"range.{k}.decay": numbers[f"range.{k}.decay"] * random.uniform(0.7, 1.3) for k in range(3)}
    kind = random.integers(5)
    if kind < 2:
        drawn[f"drive.gain_{('left', 'right')[kind]}"] *= random.uniform(0.02, 0.8)
    elif kind == 2:
        share = random.uniform(0.4, 0.9)
        drawn |= {name: drawn[name] * share for name in ("drive.gain_left", "drive.gain_right")}
    elif kind == 3:
        drawn["drive.drift_per_m"] += random.uniform(0.5, 1.5) * random.choice([-1, 1])
    else:
        drawn[f"range.{random.integers(3)}.amplitude"] = 0.01
    return drawn


def parameters() -> dict[str, Any]:
    """Return the mean score of searches by their numbers and budget."""
    condition = choose_condition("sim-paper", "coverage-sim", 1)
    numbers, random = as_sim(condition.on).model.centers(), np.random.default_rng(20261129)
    judged: dict[SearchRules, list[list[float]]] = {rules: [] for rules in SETS}
    best = []
    for replicate in range(REPLICATES):
        simulation, conditions = Simulation(RUNS, REPEATS), damaged_conditions(condition)
        each = [finalists(simulation.repertoire(one, replicate, len(conditions))) for one in conditions]
        repertoire = tried_under(joined(each), conditions, replicate)
        genomes = [champion.genome for champion in repertoire.champions]
        place = {id(genome): k for k, genome in enumerate(genomes)}
        for robot in range(ROBOTS):
            target = changed_condition(condition, f"robot-{robot}", set=drawn_robot(random, numbers))
            keys = [NoiseKey(target.key, replicate, 0, k) for k in range(len(genomes))]
            batch, scores = try_repeatedly(target, genomes, keys, range(TRIALS))
            crossed, true = crossed_cells(batch, TRIALS), scores[:, JUDGED_FROM:].mean(axis=1)
            best.append(true[scores[:, :JUDGED_FROM].mean(axis=1).argmax()])
            for rules, found in judged.items():
                chosen = []
                for budget in BUDGETS_OF_PARAMETERS:
                    recorded = Recorded(target, genomes, crossed, scores, budget)
                    chosen.append(true[place[id(search(recorded, repertoire, rules).genome)]])
                found.append(chosen)
    return {
        "label": "SIM",
        "robots": len(best),
        "best_by_12_trials_of_each": float(np.mean(best)),
        "budgets": BUDGETS_OF_PARAMETERS,
        "table": [
            {
                **rules._asdict(),
                "unlikely": rules.unlikely if math.isfinite(rules.unlikely) else None,
                "scores": np.mean(found, axis=0).round(4).tolist(),
            }
            for rules, found in judged.items()
        ],
    }


def main() -> None:
    """Carry out one of the commands."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("command", choices=("run", "analyze", "parameters"))
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--processes", type=int, default=multiprocessing.cpu_count())
    parser.add_argument("--out", type=Path, help="folder of the tables")
    arguments = parser.parse_args()
    if arguments.folder is None and arguments.command != "parameters":
        parser.error(f"{arguments.command} needs the FOLDER of the study.")
    if arguments.command == "run":
        run(arguments.folder, arguments.processes)
        return
    if arguments.out is None:
        parser.error(f"{arguments.command} needs --out FOLDER.")
    is_analysis = arguments.command == "analyze"
    found = analyze(arguments.folder) if is_analysis else parameters()
    path = arguments.out / ("recovery.json" if is_analysis else "recovery-parameters.json")
    path.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    print(f"Written: {path}")


if __name__ == "__main__":
    main()
