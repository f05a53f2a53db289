"""Fit robots of other people by their measurements, and predict what the fits did not see.

    python benchmarks/real_data.py --data DIR

DIR has the folders khepera-ir, labyrinth, motors, and cube-push, as docs/explanations/real-data.md describes them. The
files are not part of this project. The figures go into docs/data/real-data.json, from which the page is made. Takes
about a minute.
"""

from __future__ import annotations

import argparse
import csv
import json
import statistics
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from realitygap.platforms import JyroPlatform
from realitygap.study import calibrate_from_log, calibrate_from_table

OUT = Path(__file__).parent.parent / "docs" / "data" / "real-data.json"
GOALS = {
    "wall": 0.025,
    "wall between": 0.060,
    "wall over neighbors": 1.25,
    "motors": 1.0,
    "labyrinth over nominal": 1.0,
}
"""Stated before the results: errors of readings, a ratio, percent of full speed, and a ratio."""

MOUNTS = (
    (9.7, 24.1, 90), (19.0, 17.7, 45), (25.3, 5.8, 10), (25.3, -5.8, -10),
    (19.0, -17.7, -45), (9.7, -24.1, -90), (-24.1, -9.7, -180), (-24.1, 9.7, 180),
)  # fmt: skip
KHEPERA_BEFORE = """\
base = "khepera"
name = "khepera-before"
[each.range]
cone_deg = 20
rays = 3
reach_mm = 100
response = "ir"
amplitude = 1.49
decay_mm = 25
""" + "".join(f"[[range]]\nx_mm = {x}\ny_mm = {y}\ndirection_deg = {angle}\n" for x, y, angle in MOUNTS)
"""Nominal numbers by the literature: the sensors of the robot file `khepera` were fitted to this very table."""

LABYRINTH_ROBOT = """\
base = "pioneer"
name = "labyrinth"
[drive]
speed = 1.0
track = 0.157
lag = 0.0
"""
LABYRINTH_MAP = """\
[commands]
file = "odom.txt"
time = 2
left = 4
right = 3
left_sign = -1
right_sign = -1
[poses]
file = "gt.txt"
time = 2
x = 3
y = 4
"""
PWM = np.arange(0.10, 0.701, 0.01)
"""Shares at which all 28 motors turn."""


def wall(data: Path) -> dict[str, Any]:
    """The infrared sensors of a Khepera beside a wall; every second place is held out."""
    with tempfile.TemporaryDirectory() as temporary:
        robot = Path(temporary) / "khepera-before.toml"
        robot.write_text(KHEPERA_BEFORE, "utf-8")
        made = calibrate_from_table(data / "khepera-ir" / "khepera-wall.sample", base=robot)
    return {
        "held_out": made.evidence["held_out"],
        "fitted": [[each.name, each.estimate, each.low, each.high, each.unit] for each in made.fitted],
        "notes": list(made.notes),
    }


def labyrinth(data: Path) -> dict[str, Any]:
    """30 s of a small robot; the last half is held out, and blocks of the log."""
    with tempfile.TemporaryDirectory() as temporary:
        robot, mapping = Path(temporary) / "labyrinth.toml", Path(temporary) / "map.toml"
        robot.write_text(LABYRINTH_ROBOT, "utf-8")
        mapping.write_text(LABYRINTH_MAP, "utf-8")
        made, blocks = (
            calibrate_from_log(data / "labyrinth", map_file=mapping, base=robot, hold_out=share)
            for share in (0.5, "blocks")
        )
    return {
        "held_out": made.evidence["held_out"],
        "blocks": blocks.evidence["held_out"],
        "fitted": [[each.name, each.estimate, each.low, each.high, each.unit] for each in made.fitted],
        "notes": [note for note in made.notes if not note.startswith("Mapping")],
    }


def motors(data: Path) -> dict[str, Any]:
    """28 motors: what was fitted ahead predicts the same motor back, as percent of its full speed."""
    with (data / "motors" / "fits.csv").open(encoding="utf-8") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    errors: dict[str, list[float]] = {}
    for row in rows:
        full = row["gain_back"] * (PWM[-1] - row["dead_band_back"])
        seen = row["gain_back"] * (PWM - row["dead_band_back"])
        ahead = row["gain_ahead"] * (PWM - row["dead_band_ahead"])
        others = [other for other in rows if other["robot"] != row["robot"]]
        gain, dead_band = (
            statistics.mean(other[key] for other in others) for key in ("gain_ahead", "dead_band_ahead")
        )
        alone = (ahead @ PWM) / (PWM @ PWM)
        predicted = {
            "fitted: gain and soft dead band": ahead,
            "nominal: mean of the other robots": gain * (PWM - dead_band),
            "gain alone": alone * PWM,
        }
        for name, speeds in predicted.items():
            off = np.sqrt(np.mean((speeds - seen) ** 2) + row["residual_back"] ** 2)
            errors.setdefault(name, []).append(100 * float(off) / full)
        nominal = errors["nominal: mean of the other robots"][-1]
        noise = 100 * JyroPlatform.default_noise / np.sqrt(3)
        errors.setdefault("nominal, uniform noise", []).append(float(np.hypot(nominal, noise)))
    return {
        "n": len(rows),
        "errors": {
            name: [round(statistics.median(each), 3), round(max(each), 3)] for name, each in errors.items()
        },
        "by": {
            f"robot {robot:.0f}": round(
                statistics.median(
                    error
                    for error, row in zip(errors["fitted: gain and soft dead band"], rows, strict=True)
                    if row["robot"] == robot
                ),
                3,
            )
            for robot in sorted({row["robot"] for row in rows})
        },
    }


def cube(data: Path) -> dict[str, Any]:
    """Where a pushed cube ends, on a robot and in seven simulators: mean, spread, and trials that have an end."""
    table = pl.read_csv(data / "cube-push" / "end-poses.csv", schema_overrides={"end_x_m": pl.Float64})
    ends = table.with_columns(pl.col("end_x_m").fill_nan(None)).drop_nulls("end_x_m")
    rows = {}
    for (platform,), trials in ends.group_by("platform", maintain_order=True):
        x = trials["end_x_m"]
        rows[platform] = [len(x), round(float(x.median() or 0.0), 4), round(float(x.std() or 0.0), 4)]  # type: ignore[arg-type]
    return rows


def main() -> None:
    """Measure all four, and write the figures down."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True, metavar="DIR", help="Folder of the data sets.")
    parser.add_argument("--out", type=Path, default=OUT, metavar="FILE", help="Figures to write (.json).")
    options = parser.parse_args()
    found = {"goals": GOALS}
    for name, measure in (("wall", wall), ("labyrinth", labyrinth), ("motors", motors), ("cube", cube)):
        print(name, flush=True)
        found[name] = measure(options.data)
    options.out.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    print(f"Written: {options.out}")


if __name__ == "__main__":
    main()
