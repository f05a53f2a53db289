"""The results of the study, read from the files of its units or from the published tables."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from realitygap.records import read_object

from .plan import FAMILIES, Plan, Twin, Unit

Scores = NDArray[np.float64]
FITS = ("name", "estimate", "low", "high", "prior_low", "prior_high", "identified", "unit")


@dataclass(frozen=True)
class Results:
    """All results of a study, by twin and unit."""

    plan: Plan
    units: Mapping[tuple[Twin, Unit], dict[str, Any]]

    def missing(self, task: str, families: Sequence[str] = FAMILIES) -> list[str]:
        """Return the units of a task that are missing, for the twins of some families."""
        return [
            f"{twin} {unit}"
            for twin in self.plan.names()
            for unit in self.plan.units(twin)
            if twin.family in families and unit.task == task and (twin, unit) not in self.units
        ]

    def get(self, twin: Twin, task: str, what: str) -> dict[str, Any] | None:
        """Return the result of a unit, None if it is missing. An arm whose fit failed scores as `plain`."""
        found = self.units.get((twin, Unit(task, what)))
        if found is None or "failed" not in found:
            return found
        plain = self.units.get((twin, Unit(task, "plain")))
        if plain is None:
            return None
        champions = plain["champions"] if self.plan.arm[what].evolves else []
        return {**plain, "champions": champions, "calibration": None, "failed": found["failed"]}

    def twins(self, families: Sequence[str] = FAMILIES) -> list[Twin]:
        """Return the twins of families whose held-out controllers were driven."""
        return [
            twin
            for twin in self.plan.names()
            if twin.family in families and self.get(twin, "coverage", "judged")
        ]


def read_units(plan: Plan, folder: Path) -> tuple[Results, dict[str, Any]]:
    """Return the results in a folder of `run`, and the facts about them.

    Raises:
        SystemExit: There are none, one is of another plan, they are of several states of the code, a score is not
            finite, or the held-out controllers of a twin were not driven.
    """
    found: dict[tuple[Twin, Unit], dict[str, Any]] = {}
    for twin in plan.names():
        for unit in plan.units(twin):
            path = folder / "units" / f"{twin}-{unit}.json"
            if not path.exists():
                continue
            found[twin, unit] = read_object(path)
            if found[twin, unit]["plan"] != plan.digest:
                raise SystemExit(f"{path} is of another plan. Nothing was written.")
            if not all(map(math.isfinite, _all_scores(found[twin, unit]))):
                raise SystemExit(f"{path} has a score that is not finite. Nothing was written.")
            if (twin, Unit(unit.task, "judged")) not in found:
                raise SystemExit(
                    f"{path} is there, but not the result {unit.task}-judged of the same twin. Compute it: "
                    f"python -m benchmarks.closing run {folder}"
                )
    if not found:
        raise SystemExit(f"{folder} has no results. Compute them: python -m benchmarks.closing run {folder}")
    codes = {unit["code"] for unit in found.values()}
    if len(codes) > 1:
        raise SystemExit(f"The results are of {len(codes)} states of the code. Nothing was written.")
    facts = {
        "plan": plan.digest,
        "commit": plan.commit,
        "code": codes.pop(),
        "software": sorted({unit["software"] for unit in found.values()}),
        "units": len(found),
        "of": sum(1 for twin in plan.names() for _ in plan.units(twin)),
        "core_hours_of_units": round(sum(unit["seconds"] for unit in found.values()) / 3600, 2),
        "failed": [
            f"{twin} {unit}: {each['failed']}" for (twin, unit), each in found.items() if "failed" in each
        ],
    }
    return Results(plan, found), facts


def _all_scores(result: Mapping[str, Any]) -> list[float]:
    champions = [each[side] for each in result.get("champions", ()) for side in ("simulated", "target")]
    return np.concatenate([np.ravel(each) for each in (result["scores"], *champions)]).tolist()


def collect(plan: Plan, folder: Path, out: Path) -> None:
    """Write the results of a folder of `run` as two tables, `scores.parquet` and `fits.parquet`, and `facts.json`."""
    results, facts = read_units(plan, folder)
    if out.exists() and not out.is_dir():
        raise SystemExit(f"{out} is a file, expected a folder. Nothing was written.")
    out.mkdir(parents=True, exist_ok=True)
    scores_of(results).write_parquet(out / "scores.parquet", compression="zstd", compression_level=22)
    fits_of(results).write_parquet(out / "fits.parquet", compression="zstd")
    (out / "facts.json").write_text(json.dumps(facts, indent=2) + "\n")
    print(json.dumps(facts))


def scores_of(results: Results) -> pl.DataFrame:
    """Return each trial's score: a row for each."""
    rows: list[tuple[Any, ...]] = []
    for (twin, unit), result in results.units.items():
        head = (str(twin), twin.family, unit.task)
        if unit.what == "judged":
            for batch, scores in enumerate(result["scores"], start=1):
                rows += _rows((*head, "target"), result["kinds"], scores, batch)
            continue
        if "failed" in result:
            continue
        kinds = results.units[twin, Unit(unit.task, "judged")]["kinds"]
        rows += _rows((*head, unit.what), kinds, result["scores"], 0)
        for k, champion in enumerate(result["champions"]):
            for side in ("simulated", "target"):
                rows += _rows((*head, unit.what), [f"evolved, {side}"], [champion[side]], 0, first=k)
    return pl.DataFrame(
        rows, orient="row",
        schema={
            "twin": pl.String, "family": pl.String, "task": pl.String, "arm": pl.String, "kind": pl.String,
            "controller": pl.Int32, "batch": pl.Int8, "trial": pl.Int32, "score": pl.Float64,
        },
    )  # fmt: skip


def _rows(
    head: tuple[str, ...], kinds: Sequence[str], scores: Sequence[Sequence[float]], batch: int, first: int = 0
) -> Iterable[tuple[Any, ...]]:
    return [
        (*head, kind, first + c, batch, trial, score)
        for c, (kind, row) in enumerate(zip(kinds, scores, strict=True))
        for trial, score in enumerate(row)
    ]


def fits_of(results: Results) -> pl.DataFrame:
    """Return each fitted parameter: a row for each, with the verdict of the fit that it belongs to."""
    rows = [
        (str(twin), unit.what, fit["misspecified"], fit["misspecification_p"], *(each[key] for key in FITS))
        for (twin, unit), result in results.units.items()
        if unit.task == "coverage" and (fit := result.get("calibration")) is not None
        for each in fit["fitted"]
    ]
    kinds = dict.fromkeys(FITS, pl.Float64()) | {
        "name": pl.String(),
        "identified": pl.Boolean(),
        "unit": pl.String(),
    }
    head = {
        "twin": pl.String(),
        "arm": pl.String(),
        "misspecified": pl.Boolean(),
        "misspecification_p": pl.Float64(),
    }
    return pl.DataFrame(rows, schema=head | kinds, orient="row")


def read_collected(plan: Plan, folder: Path) -> Results:
    """Return the results that `collect` wrote.

    Args:
        plan: Plan of the study.
        folder: Folder with `scores.parquet`, `fits.parquet`, and `facts.json`.

    Raises:
        SystemExit: One of them is missing, or they are of another plan.
    """
    for name in ("scores.parquet", "fits.parquet", "facts.json"):
        if not (folder / name).exists():
            raise SystemExit(
                f"{folder / name} does not exist. Write it: python -m benchmarks.closing collect RESULTS --out {folder}"
            )
    try:
        facts = json.loads((folder / "facts.json").read_text())
    except ValueError as error:
        raise SystemExit(
            f"{folder / 'facts.json'} is damaged ({error}). Write it again: "
            f"python -m benchmarks.closing collect RESULTS --out {folder}"
        ) from None
    if facts.get("plan") != plan.digest:
        raise SystemExit(f"{folder} has the scores of another plan. Nothing was written.")
    names = {str(twin): twin for twin in plan.names()}
    units: dict[tuple[Twin, Unit], dict[str, Any]] = {}
    table = pl.read_parquet(folder / "scores.parquet")
    for (twin, task, arm), rows in table.partition_by("twin", "task", "arm", as_dict=True).items():
        unit = Unit(task, "judged" if arm == "target" else arm)
        units[names[twin], unit] = _judged(rows) if arm == "target" else _of_arm(rows)
    fits = pl.read_parquet(folder / "fits.parquet")
    for (twin, arm), rows in fits.partition_by("twin", "arm", as_dict=True).items():
        head = rows.select("misspecified", "misspecification_p").row(0, named=True)
        units[names[twin], Unit("coverage", arm)]["calibration"] = head | {
            "fitted": rows.select(FITS).to_dicts()
        }
    for text in facts["failed"]:
        what, _, message = text.partition(": ")
        twin, _, unit = what.partition(" ")
        task, _, arm = unit.partition("-")
        units[names[twin], Unit(task, arm)] = {"failed": message, "scores": [], "champions": []}
    return Results(plan, units)


def _judged(rows: pl.DataFrame) -> dict[str, Any]:
    kinds = rows.unique("controller").sort("controller")["kind"].to_list()
    return {"kinds": kinds, "scores": [_matrix(rows.filter(pl.col("batch") == k)) for k in (1, 2)]}


def _of_arm(rows: pl.DataFrame) -> dict[str, Any]:
    sides = [rows.filter(pl.col("kind") == f"evolved, {side}") for side in ("simulated", "target")]
    champions = [
        {"simulated": simulated, "target": driven}
        for simulated, driven in zip(*map(_matrix, sides), strict=True)
    ]
    held_out = rows.filter(~pl.col("kind").str.starts_with("evolved"))
    return {"scores": _matrix(held_out), "champions": champions, "calibration": None}


def _matrix(rows: pl.DataFrame) -> list[list[float]]:
    """Return the scores of each controller, in the order of their numbers."""
    ordered = rows.sort("controller", "trial").group_by("controller", maintain_order=True)
    return ordered.agg("score")["score"].to_list()
