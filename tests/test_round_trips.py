"""Each file that realitygap writes for its own readers is read back as it was, whatever texts and numbers are in it."""

from __future__ import annotations

import csv
import json
import math
import tempfile
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.families.scribbler.emulator._memory import Memory
from realitygap.logs import (
    Commands,
    LogMap,
    Poses,
    RangeTable,
    TableColumns,
    TableMap,
    TextFormat,
    import_log,
    load_log_map,
    load_table_map,
    open_source,
    round_robot,
    write_bag,
)
from realitygap.records import ObservationsHead, TrialRecord, read_observations, write_observations
from realitygap.robots import read_recording
from realitygap.robots._recording import Recorder
from realitygap.robots.twin import load_twin, sample_twin
from realitygap.study import load_study, study_template
from realitygap.vision import Lens, Track, read_lens, read_map, save_map
from realitygap.world import Arena, Calibration, Fitted, Grid, Pose, load_arena, load_calibration, load_robot

TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
NAME = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12)
FILE_NAME = st.text(
    st.characters(exclude_categories=["Cs"], exclude_characters="/\0"), min_size=1, max_size=12
).filter(lambda name: name.strip(". ") != "")
NUMBER = st.floats(allow_nan=False, allow_infinity=False)
NINE_DIGITS = st.floats(-1e6, 1e6).map(lambda value: float(f"{value:.9g}"))
"""Numbers as TOML files for people have them."""


class Trip(NamedTuple):
    """What is written, and a function that writes it into a folder, reads it back, and compares both."""

    drawn: st.SearchStrategy[Any]
    check: Callable[[Any, Path], None]
    n_examples: int = 25


def room(x: float, y: float, width: float, height: float, name: str = "room") -> Arena:
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    walls = tuple((*corners[k], *corners[(k + 1) % 4]) for k in range(4))
    start = Pose(x + width / 2, y + height / 2, 0.5)
    return Arena(name, walls, Grid(x, y, max(width, height) / 4, 4, 4), start)


def ros_map(drawn: Any, folder: Path) -> None:
    arena = room(*drawn["place"], *(n * drawn["pixel"] for n in drawn["size"]), drawn["name"])
    path = folder / f"{drawn['file']}.yaml"
    image = save_map(arena, path, resolution=drawn["pixel"])
    found = read_map(path)
    assert (found.free == (np.asarray(Image.open(image)) == 254)).all()
    assert found.resolution == pytest.approx(drawn["pixel"], abs=1e-9)
    column, row = found.to_image(arena.start.x, arena.start.y)
    assert found.free[row, column]
    left = arena.walls[0][0] - 4.5 * drawn["pixel"]
    assert found.origin.x == pytest.approx(left, abs=1e-8)


def arena_file(drawn: Any, folder: Path) -> None:
    arena = room(*drawn["place"], 1.5, 1.25, drawn["name"])
    (folder / "arena.toml").write_text(arena.to_toml(), "utf-8")
    found = load_arena(folder / "arena.toml")
    assert found.name == arena.name
    assert np.array(found.walls) == pytest.approx(np.array(arena.walls), rel=1e-8, abs=1e-8)
    assert found.to_toml() == arena.to_toml()


def calibration(drawn: Any, folder: Path) -> None:
    prior_low, low, estimate, high, prior_high = drawn["interval"]
    fitted = Fitted(
        name=drawn["name"], unit=drawn["unit"], estimate=estimate, low=low, high=high, prior_low=prior_low,
        prior_high=prior_high, identified=True,
    )  # fmt: skip
    made = Calibration(
        kind="motion", robot="scribbler-s2-fluke2", label="TWIN", observe="track", trials=3, **drawn["texts"],
        fitted=(fitted,), numbers={"drive.track": 0.15},
        draws={"drive.track": tuple(drawn["draws"])}, evidence={"held_out": drawn["evidence"]},
    )  # fmt: skip
    (folder / "fit.toml").write_text(made.to_toml(), "utf-8")
    assert load_calibration(folder / "fit.toml").model_dump() == made.model_dump()


def twin(drawn: Any, folder: Path) -> None:
    made = sample_twin(drawn["family"], drawn["seed"]).model_copy(update=drawn["texts"])
    (folder / "twin.toml").write_text(made.to_toml(), "utf-8")
    assert load_twin(folder / "twin.toml") == made


def lens(drawn: Any, folder: Path) -> None:
    made = Lens(
        640, 480, tuple(drawn["focal"]), tuple(drawn["center"]), tuple(drawn["distortion"]), drawn["rms"]
    )
    (folder / "lens.toml").write_text(made.to_toml(), "utf-8")
    assert read_lens(folder / "lens.toml").to_toml() == made.to_toml()


def log_map(drawn: Any, folder: Path) -> None:
    (folder / "log.map.toml").write_text(drawn.to_toml(), "utf-8")
    assert load_log_map(folder / "log.map.toml") == drawn


def table_map(drawn: Any, folder: Path) -> None:
    (folder / "table.map.toml").write_text(drawn.to_toml(), "utf-8")
    assert load_table_map(folder / "table.map.toml") == drawn


def genome(drawn: Any, folder: Path) -> None:
    population = Population(2, 1, NeatSettings(population=2), seed=drawn["seed"])
    values = json.loads(population.ask()[0].to_json())
    for connection, weight in zip(values["connections"], drawn["weights"], strict=False):
        connection["weight"] = weight
    made = Genome.from_json(json.dumps(values))
    made.save(folder / "genome.json")
    assert Genome.load(folder / "genome.json").to_json() == made.to_json()


def checkpoint(seed: Any, folder: Path) -> None:
    made = Population(3, 2, NeatSettings(population=4), seed=seed)
    made.save(folder / "p.npz")
    assert [each.to_json() for each in Population.load(folder / "p.npz").ask()] == [
        each.to_json() for each in made.ask()
    ]


def trials_of(drawn: Any) -> tuple[ObservationsHead, list[TrialRecord]]:
    n = len(drawn["commands"])
    head = ObservationsHead(
        drawn["target"], "REAL", "scribbler-s2-fluke2", room(0, 0, 2, 1).to_dict(), 0.5, "track"
    )
    path = np.column_stack([np.cumsum(drawn["steps"]), np.zeros(n + 1), np.zeros(n + 1)])
    trial = TrialRecord(
        start=(0.1, 0.2, 0.3), step_s=0.5, commands=np.array([[command, 0.0] for command in drawn["commands"]]),
        readings=np.full((n, 3), 0.25), stalled=np.zeros(n, bool), cells=(1, 5), wheels=np.zeros((n + 1, 2)),
        poses=path, purpose=drawn["purpose"], battery_v=drawn["volts"], problem=drawn["problem"],
    )  # fmt: skip
    return head, [trial]


def observations(drawn: Any, folder: Path) -> None:
    head, trials = trials_of(drawn)
    write_observations(folder / "trials.jsonl", head, trials)
    found = read_observations(folder / "trials.jsonl")
    assert found.head.to_dict() == head.to_dict()
    for one, other in zip(found.trials, trials, strict=True):
        for name, value in asdict(other).items():
            np.testing.assert_array_equal(getattr(one, name), value, err_msg=name)


def bag(drawn: Any, folder: Path) -> None:
    head, (trial,) = trials_of(drawn)
    out = folder / "drive.mcap"
    write_bag(trial, head, out)
    import_log(out, folder / "again.jsonl", load_log_map(folder / "drive.map.toml"))
    (again,) = read_observations(folder / "again.jsonl").trials
    n = len(again.commands)
    assert n >= len(trial.commands) - 1
    assert again.commands == pytest.approx(trial.commands[:n], abs=1e-6)


class Stopped:
    """A clock that does not move."""

    def now(self) -> float:
        return 1.0

    def sleep(self, seconds: float) -> None:
        raise NotImplementedError


def recording(drawn: Any, folder: Path) -> None:
    recorder = Recorder(folder / "recording.jsonl", Stopped())
    recorder.begin({"robot": drawn["robot"]})
    for name, value in drawn["calls"]:
        recorder.call(name, value=value)
    recorder.close()
    found = read_recording(folder / "recording.jsonl")
    assert found.header["robot"] == drawn["robot"]
    assert [(line["name"], line["values"]["value"]) for line in found.lines] == [
        tuple(each) for each in drawn["calls"]
    ]


def robot_of_a_table(drawn: Any, folder: Path) -> None:
    bearing = np.tile(np.linspace(-3, 3, 12), 2)
    readings = np.exp(-((bearing - drawn["direction"]) ** 2)) * np.repeat([0.5, 0.2], 12)
    distance = np.repeat([0.05, 0.1], 12)
    table = RangeTable(np.zeros(24, int), distance, bearing, readings, "body", False)
    (folder / "robot.toml").write_text(round_robot(table, 0.08, drawn["name"], clockwise=False), "utf-8")
    found = load_robot(folder / "robot.toml")
    assert found.name == drawn["name"]
    assert found.range[0].direction == pytest.approx(drawn["direction"], abs=0.2)


def new_study(drawn: Any, folder: Path) -> None:
    (folder / "study.toml").write_text(study_template(*drawn), "utf-8")
    study = load_study(folder / "study.toml")
    assert study.about.name == drawn[0]
    assert study.conditions


def memory(drawn: Any, folder: Path) -> None:
    made = Memory("s2", folder / "memory.json")
    for page, offset, value in drawn["pages"]:
        made.write_page(page, offset, value)
    made.set_echo(drawn["echo"])
    again = Memory("s2", folder / "memory.json")
    assert (again.pages, again.echo, again.name) == (made.pages, made.echo, made.name)


def track(drawn: Any, folder: Path) -> None:
    poses = np.array(drawn, np.float64).reshape(-1, 3)
    made = Track(np.arange(len(poses)) / 30, poses, np.ones(len(poses), bool))
    (folder / "track.csv").write_text(made.to_csv())
    names = ["time_s", "x_m", "y_m", "heading_rad"]
    (batch,) = open_source(folder / "track.csv").batches(names)
    found = np.column_stack([batch.columns[name] for name in names])
    assert found == pytest.approx(np.column_stack([made.times, poses]), abs=6e-5)


def table_of_a_report(drawn: Any, folder: Path) -> None:
    from realitygap.report._export import _csv

    (folder / "table.csv").write_bytes(_csv(drawn))
    with (folder / "table.csv").open(encoding="utf-8", newline="") as file:
        assert list(csv.reader(file)) == drawn


def frame_of_results(drawn: Any, folder: Path) -> None:
    import polars as pl

    frame = pl.DataFrame({"condition": [name for name, _ in drawn], "value": [value for _, value in drawn]})
    (folder / "frame.csv").write_bytes(frame.write_csv().encode("utf-8"))
    assert pl.read_csv(folder / "frame.csv", schema=frame.schema).equals(frame)


PLACE = st.tuples(NINE_DIGITS.filter(lambda x: abs(x) < 5e3), NINE_DIGITS.filter(lambda x: abs(x) < 5e3))
EVIDENCE = st.recursive(
    st.booleans() | st.integers(-(2**63), 2**63 - 1) | NUMBER | TEXT,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=6,
)
COMMANDED = st.fixed_dictionaries(
    {
        "target": TEXT, "purpose": NAME, "problem": TEXT, "volts": st.floats(0, 9) | st.just(math.nan),
        "commands": st.lists(st.floats(-1, 1), min_size=5, max_size=5),
        "steps": st.lists(st.floats(-1e-3, 1e-3), min_size=6, max_size=6),
    }
)  # fmt: skip
COLUMN = NAME

TRIPS: dict[str, Trip] = {
    "map of ROS": Trip(
        st.fixed_dictionaries(
            {
                "name": NAME, "file": FILE_NAME, "place": PLACE, "pixel": st.floats(1e-3, 2.0),
                "size": st.tuples(st.integers(4, 60), st.integers(4, 60)),
            }
        ),
        ros_map, 60,
    ),
    "arena file": Trip(st.fixed_dictionaries({"name": NAME, "place": PLACE}), arena_file),
    "calibration file": Trip(
        st.fixed_dictionaries(
            {
                "texts": st.fixed_dictionaries(
                    {"target": TEXT, "date": TEXT, "method": TEXT, "arena": TEXT, "software": TEXT, "verdict": TEXT}
                    | {"notes": st.lists(TEXT, max_size=2).map(tuple), "reasons": st.lists(TEXT, max_size=2).map(tuple)}
                ),
                "name": NAME,
                "unit": TEXT,
                "interval": st.lists(NUMBER, min_size=5, max_size=5).map(sorted),
                "draws": st.lists(st.floats(0.1, 0.2), min_size=1, max_size=3),
                "evidence": st.dictionaries(TEXT, EVIDENCE, max_size=3),
            }
        ),
        calibration, 60,
    ),
    "twin file": Trip(
        st.fixed_dictionaries(
            {
                "family": st.sampled_from(["close", "worn"]), "seed": st.integers(0, 10**6),
                "texts": st.fixed_dictionaries({"name": NAME, "family": TEXT}),
            }
        ),
        twin,
    ),
    "lens file": Trip(
        st.fixed_dictionaries(
            {
                "focal": st.lists(st.floats(1, 1e5), min_size=2, max_size=2),
                "center": st.lists(NUMBER, min_size=2, max_size=2).map(np.array),
                "distortion": st.lists(NUMBER, min_size=5, max_size=5), "rms": st.floats(0, 9) | st.just(math.nan),
            }
        ),
        lens,
    ),
    "mapping of a log": Trip(
        st.builds(
            LogMap, robot=st.just("pioneer"), trial=TEXT, step_s=NINE_DIGITS.map(abs),
            text=st.builds(TextFormat, names=st.lists(TEXT, max_size=2).map(tuple), header=st.none() | st.booleans()),
            commands=st.builds(Commands, left=COLUMN, right=COLUMN, time=TEXT, rows=TEXT, offset_s=NINE_DIGITS),
            poses=st.builds(Poses, x=COLUMN, y=COLUMN, heading=TEXT) | st.none(),
        ),
        log_map,
    ),
    "mapping of a table": Trip(
        st.builds(
            TableMap, first_bearing_deg=NINE_DIGITS, clockwise=st.none() | st.booleans(),
            columns=st.builds(TableColumns, distance=COLUMN, reading=COLUMN, bearing=TEXT),
        ),
        table_map,
    ),
    "genome": Trip(
        st.fixed_dictionaries({"seed": st.integers(0, 9), "weights": st.lists(NUMBER, min_size=2, max_size=2)}), genome
    ),
    "checkpoint": Trip(st.integers(0, 2**63 - 1), checkpoint, 3),
    "file of trials": Trip(COMMANDED, observations),
    "bag of ROS": Trip(COMMANDED, bag, 3),
    "recording": Trip(
        st.fixed_dictionaries(
            {"robot": TEXT, "calls": st.lists(st.tuples(NAME, TEXT | NUMBER | st.lists(NUMBER)), max_size=3)}
        ),
        recording,
    ),
    "robot of a table": Trip(
        st.fixed_dictionaries({"name": NAME, "direction": st.floats(-2, 2)}), robot_of_a_table
    ),
    "new study": Trip(
        st.tuples(
            st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._-]{0,20}", fullmatch=True),
            st.sampled_from([None, "paper", "sim-paper"]),
        ),
        new_study, 6,
    ),
    "memory of an emulator": Trip(
        st.fixed_dictionaries(
            {
                "pages": st.lists(st.tuples(st.integers(0, 15), st.integers(0, 400), st.integers(0, 255)), max_size=4),
                "echo": st.integers(0, 1),
            }
        ),
        memory,
    ),
    "track of a camera": Trip(st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6), track),
    "table of a report": Trip(
        st.lists(st.lists(TEXT, min_size=2, max_size=2), min_size=1, max_size=3), table_of_a_report, 60
    ),
    "table of results": Trip(st.lists(st.tuples(TEXT, NUMBER), min_size=1, max_size=3), frame_of_results, 60),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", TRIPS)
def test_file_is_read_back_as_it_was_written(name: str) -> None:
    trip = TRIPS[name]

    @settings(
        derandomize=True, database=None, deadline=None, max_examples=trip.n_examples,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(trip.drawn)
    def check(drawn: Any) -> None:
        with tempfile.TemporaryDirectory() as folder:
            trip.check(drawn, Path(folder))

    check()
