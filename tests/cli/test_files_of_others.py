"""Reading results, studies or other files of others never runs code that is in them."""

from __future__ import annotations

import contextlib
import json
import shutil
import sqlite3
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import realitygap
from realitygap._toml import toml_table
from realitygap.cli import app
from realitygap.errors import RealityGapError, StudyError
from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.lab._studies import Studies
from realitygap.lab._study import study_of
from realitygap.platforms import SimPlatform
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder, read_observations, write_observations
from realitygap.report import export_frame, export_individual, save_view, summarize_tasks
from realitygap.report._driven import read_driven
from realitygap.robots import read_recording
from realitygap.robots.twin import load_twin, sample_twin
from realitygap.runs import Condition, replay, run_replicates
from realitygap.study import (
    ConditionNotes,
    ReportSection,
    Study,
    StudySection,
    choose_condition,
    load_study,
    run_study,
    sample_controllers,
)
from realitygap.tasks import _python
from realitygap.world import Calibration, load_arena, load_robot, read_calibration
from tests.python_tasks import marking_source, study_text
from tests.records.test_observations_file import HEAD
from tests.records.test_observations_file import trial as observed_trial
from tests.robots.test_recording import record

pytestmark = pytest.mark.slow

STUDY = study_text(
    '[[condition]]\nname = "coverage"\nplatform = "sim"\n[condition.task]\nkind = "coverage"\n',
    replicates=2,
    population=4,
    generations=2,
    steps=5,
)


@pytest.fixture(scope="module")
def theirs(tmp_path_factory) -> Path:
    """A study of others with its results, whose task leaves a mark when it runs."""
    root = tmp_path_factory.mktemp("theirs")
    (root / "task.py").write_text(marking_source(root / "marker"))
    (root / "study.toml").write_text(STUDY)
    run_study(root / "study.toml", root / "results", threads=1, allow_code=True)
    assert (root / "marker").read_text() == "run by the function"
    return root


@pytest.fixture
def marker(theirs) -> Iterator[Path]:
    """The mark, which is not there; the test fails if it is there afterwards."""
    path = theirs / "marker"
    path.unlink(missing_ok=True)
    _python._load.cache_clear()
    yield path
    assert not path.exists(), path.read_text()


READING = [
    "report FOLDER --out OUT/page.html --figures OUT/figures",
    "digest FOLDER",
    "show FOLDER --condition far -o OUT/run.svg",
    "show FOLDER --condition far --generation 1 -o OUT/trial.svg",
    "show FOLDER --condition far -o OUT/trial.gif",
    "show network FOLDER --condition far -o OUT/network.svg",
    "show species FOLDER --condition far -o OUT/species.svg",
    "show lineage FOLDER --condition far -o OUT/lineage.svg",
    "show movie FOLDER --condition far -o OUT/movie.gif",
    "show divergence FOLDER --condition far --against coverage --repeats 2 -o OUT/divergence.svg",
    "export FOLDER --condition far -o OUT/genome.json",
    "export species FOLDER -o OUT/species.parquet",
    "export innovations FOLDER -o OUT/innovations.parquet",
    "export lineage FOLDER -o OUT/lineage.parquet",
    "gap sim jyro --controllers FOLDER --n-controllers 2 --trials 2 --json",
]
REFUSED = [
    "run STUDY --out OUT/results",
    "run STUDY --out FOLDER --replicates 3",
    "transfer STUDY --to sim --condition far -o OUT/transfer",
    "gap sim jyro --controllers FOLDER/study.json --n-controllers 2 --trials 2",
    "trials list FOLDER",
    "print-sheet FOLDER -o OUT/sheet.pdf",
    "try FOLDER/study.json --on sim",
    "audit-results FOLDER/study.json",
    "calibrate all --from FOLDER/study.json -o OUT/fit.toml",
]


def invoke(words: str, theirs: Path, out: Path) -> Any:
    places = {"FOLDER": theirs / "results", "STUDY": theirs / "study.toml", "OUT": out}
    for name, path in places.items():
        words = words.replace(name, str(path))
    return CliRunner().invoke(app, words.split())


@pytest.mark.parametrize("words", READING)
def test_command_reads_results_without_running_their_code(words, theirs, marker, tmp_path):
    done = invoke(words, theirs, tmp_path)
    assert done.exit_code == 0, done.exception


@pytest.mark.parametrize("words", REFUSED)
def test_command_that_cannot_work_without_code_runs_none(words, theirs, marker, tmp_path):
    before = sorted(theirs.rglob("*"))
    done = invoke(words, theirs, tmp_path)
    assert done.exit_code != 0
    assert sorted(theirs.rglob("*")) == before
    assert not list(tmp_path.iterdir())


def test_gap_evolves_the_condition_for_coverage_without_running_the_code_of_another(theirs, marker):
    assert len(sample_controllers(theirs / "study.toml", 2)) == 2
    assert choose_condition(theirs / "study.toml", "coverage", 1).name == "coverage"


def test_python_reads_results_without_running_their_code(theirs, marker, tmp_path):
    folder = ResultsFolder.open(theirs / "results")
    row = folder.read("far").row(3, named=True)
    (condition,) = (each for each in folder.description["conditions"] if each["name"] == "far")
    assert list(replay(condition, row).cells) == row["cells"]
    assert summarize_tasks(folder).height == 1
    assert save_view(folder, tmp_path / "run.svg", condition="far").exists()
    assert export_individual(folder, tmp_path / "genome.json", condition="far").exists()
    assert export_frame(folder, "lineage", tmp_path / "lineage.parquet").exists()
    assert folder.scan().collect().height == 2 * 2 * 2 * 4
    study = study_of(folder.description)
    assert study.description()["conditions"] == folder.description["conditions"]
    assert Studies(theirs.resolve()).state("results").is_complete
    resolved = Condition.from_settings("far", condition["settings"])
    with pytest.raises(StudyError, match="you have not allowed this file"):
        run_replicates(resolved, 0, 1)
    with pytest.raises(StudyError, match="you have not allowed this file"):
        run_study(study, tmp_path / "results")
    assert not (tmp_path / "results").exists()


def test_a_forged_description_names_no_file_to_read_and_grants_nothing(theirs, marker):
    settings = ResultsFolder.open(theirs / "results").description["conditions"][0]["settings"]
    named = f"python:{theirs}/task.py:far"
    without = {key: value for key, value in settings["task"].items() if key != "source"}
    for task in (
        {**without, "kind": named},
        {**settings["task"], "may_run": True},
        {**settings["task"], "_may_run": True},
        {**settings["task"], "allow_code": True},
        {**settings["task"], "source": None},
    ):
        with pytest.raises(RealityGapError):
            Condition.from_settings("far", {**settings, "task": task})
    for source in ("", "\ud800", "def f(:", "\x00", "(" * 100_000):
        told = Condition.from_settings("far", {**settings, "task": {**without, "source": source}})
        assert not told.task.may_run
        with pytest.raises(StudyError, match="not allowed"):
            run_study(study_with(told), theirs / "none")
    elsewhere = Condition.from_settings("far", {**settings, "task": {**settings["task"], "kind": named}})
    assert not elsewhere.task.may_run


def study_with(condition: Condition) -> Study:
    about = StudySection(name="forged", seed=condition.seed, pair=condition.pair)
    return Study(about=about, report=ReportSection(), conditions=(condition,), notes=(ConditionNotes(),))


# Other files: each text in them names a Python task, one after the other.


def hostile_values(value: Any, instead: str) -> Iterator[Any]:
    """The value once for each text in it and once for each table, with a task there."""
    if isinstance(value, str):
        yield instead
    elif isinstance(value, dict):
        for key in value:
            yield from ({**value, key: changed} for changed in hostile_values(value[key], instead))
        yield {**value, "task": {"kind": instead, "source": instead}, "kind": instead, "source": instead}
    elif isinstance(value, list):
        for k in range(len(value)):
            yield from ([*value[:k], each, *value[k + 1 :]] for each in hostile_values(value[k], instead))


def genome_file() -> dict[str, Any]:
    settings = NeatSettings.named("rosenzweig-remy")
    found: dict[str, Any] = json.loads(Population(3, 2, settings, seed=1).ask()[0].to_json())
    return found


def calibration_file() -> dict[str, Any]:
    numbers = {"drive.speed": 0.1}
    found = Calibration(
        kind="all", robot="scribbler-s2", target="other", label="SIM", observe="cells", trials=6, date="2026-01-01",
        method="told", numbers=numbers, draws={name: (value, value) for name, value in numbers.items()},
    )  # fmt: skip
    return tomllib.loads(found.to_toml())


PACKAGE = Path(realitygap.__file__).parent


def packaged(path: str) -> dict[str, Any]:
    return tomllib.loads((PACKAGE / path).read_text("utf-8"))


FILES: dict[str, tuple[Callable[[], dict[str, Any]], Callable[[Path], Any]]] = {
    "robot.toml": (lambda: packaged("families/scribbler/robots/scribbler-s2.toml"), load_robot),
    "arena.toml": (lambda: packaged("world/arenas/light.toml"), load_arena),
    "twin.toml": (lambda: tomllib.loads(sample_twin("worn", 1).to_toml()), load_twin),
    "fit.toml": (calibration_file, read_calibration),
    "sim.toml": (calibration_file, lambda path: SimPlatform(robot=str(path))),
    "genome.json": (genome_file, Genome.load),
    "study.toml": (lambda: tomllib.loads(STUDY), load_study),
}


@pytest.mark.parametrize("name", FILES)
def test_no_text_of_a_file_is_run(name, theirs, marker, tmp_path):
    make, read = FILES[name]
    shutil.copy(theirs / "task.py", tmp_path)
    path = tmp_path / name
    write = (lambda value: json.dumps(value)) if path.suffix == ".json" else toml_table
    path.write_text(write(make()))
    read(path)
    for instead in (f"python:{theirs}/task.py:far", "python:task.py:far"):
        for value in hostile_values(make(), instead):
            path.write_text(write(value))
            with contextlib.suppress(RealityGapError, ValueError):
                read(path)


def test_no_line_of_a_recording_or_of_observations_is_run(theirs, marker, tmp_path):
    recorded, observed = tmp_path / "recorded.jsonl", tmp_path / "observed.jsonl"
    record(recorded, n_steps=1)
    write_observations(observed, HEAD, [observed_trial(0)])
    for path, read in ((recorded, read_recording), (observed, read_observations)):
        read(path)
        lines = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
        for value in hostile_values(lines, f"python:{theirs}/task.py:far"):
            path.write_text("".join(json.dumps(line) + "\n" for line in value))
            with contextlib.suppress(RealityGapError, ValueError):
                read(path)


def test_no_text_of_a_ledger_is_run(theirs, marker, tmp_path):
    shutil.copytree(theirs / "results", tmp_path / "results")
    path = tmp_path / "results" / LEDGER_NAME
    with Ledger.create(path) as ledger:
        ledger.add_condition("far", "hash", {"noise": 0.0}, n_generations=1, n_cells=72)
    with contextlib.closing(sqlite3.connect(path)) as base, base:
        base.execute(
            "update conditions set settings = ?", [json.dumps({"task": {"kind": "python:task.py:far"}})]
        )
    with contextlib.suppress(RealityGapError):
        read_driven(ResultsFolder.open(path.parent))
    for words in ("trials list FOLDER", "show FOLDER -o OUT/run.svg"):
        invoke(words, tmp_path, tmp_path)
