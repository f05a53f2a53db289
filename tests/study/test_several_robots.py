"""Studies of several robots in one arena: run, killed and resumed, shown, exported, tried."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.errors import StudyError
from realitygap.playback import first_visits
from realitygap.records import ResultsFolder
from realitygap.report import (
    choose_moving,
    compare_trials,
    draw_individuals,
    draw_paths,
    draw_trial,
)
from realitygap.report._champions import retry_champions
from realitygap.runs import Condition, replay
from realitygap.study import choose_condition, parse_study, run_study, sample_controllers

pytestmark = pytest.mark.slow

STUDY = """
[study]
name = "several"
replicates = 4

[arena]
robots = 3

[neat]
population = 6
generations = 3

[platform.sim]
steps = 20

[[condition]]
name = "one"
platform = "sim"

[[condition]]
name = "each"
platform = "sim"
[condition.arena]
networks = "each"

[[condition]]
name = "avoid"
platform = "sim"
[condition.task]
kind = "avoid"
inputs = ["range.0", "range.1", "bias"]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> ResultsFolder:
    study = parse_study(STUDY, "several.toml")
    return run_study(study, tmp_path_factory.mktemp("several") / "r", threads=1).folder


def command(*words: object) -> str:
    result = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return str(result.output)


def test_study_killed_and_resumed_has_the_same_digest(folder: ResultsFolder, tmp_path: Path) -> None:
    """In other processes, with other threads and chunks."""
    file, out = tmp_path / "several.toml", tmp_path / "r"
    file.write_text(STUDY, "utf-8")
    words = [sys.executable, "-m", "realitygap", "run", str(file), "--out", str(out), "--threads", "2"]
    process = subprocess.Popen([*words, "--chunk", "1"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None and not list(out.glob("trials/*.parquet")):
        time.sleep(0.001)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert 0 < len(list(out.glob("trials/*.parquet"))) < 12
    subprocess.run([*words, "--chunk", "3"], check=True, capture_output=True)
    assert ResultsFolder.open(out).digest() == folder.digest()


def test_more_replicates_leave_the_first_as_they_were(folder: ResultsFolder, tmp_path: Path) -> None:
    run_study(parse_study(STUDY, "several.toml", replicates=1), tmp_path / "r")
    result = run_study(parse_study(STUDY, "several.toml"), tmp_path / "r")
    assert result.n_computed == 9
    assert result.folder.digest() == folder.digest()


def test_jyro_takes_one_robot_and_the_file_is_named() -> None:
    with pytest.raises(
        StudyError, match=r"condition\[1\] 'one': arena.robots is 3, expected 1 with platform 'jyro'"
    ):
        parse_study(STUDY.replace('platform = "sim"', 'platform = "jyro"', 1), "several.toml")


@pytest.mark.parametrize("name", ["one", "each", "avoid"])
def test_figures_draw_all_robots(folder: ResultsFolder, name: str) -> None:
    for draw in (draw_paths, draw_individuals):
        assert "Each color is a robot" in draw(folder, name).caption
    trial = draw_trial(folder, name)
    assert "Readings, commands and blocked steps are of the first" in trial.caption
    field = trial.figure.axes[0]
    paths = [line for line in field.get_lines() if len(line.get_xdata()) == 21]
    assert len({line.get_color() for line in paths}) == 3


def test_movies_show_all_robots(folder: ResultsFolder) -> None:
    _, trials = choose_moving([folder.path], condition="each")
    assert [trial.title.rpartition(", ")[2] for trial in trials] == ["robot 0", "robot 1", "robot 2"]
    assert len({tuple(trial.poses[0]) for trial in trials}) == 3
    _, many = choose_moving([folder.path], "generation", "one")
    assert len(many) == 8


def test_first_visits_are_those_of_all_robots(folder: ResultsFolder) -> None:
    described = next(each for each in folder.description["conditions"] if each["name"] == "one")
    condition = Condition.from_settings("one", dict(described["settings"]))
    for row in folder.read("one", [0]).iter_rows(named=True):
        trial = replay(condition, row)
        cells, steps, ends = first_visits(
            np.stack([robot.poses for robot in trial.robots]), condition.arena.arena().grid
        )
        assert cells.tolist() == row["cells"]
        assert len(ends) == round(72 * row["coverage_ends"])
        assert (np.diff(steps) >= 0).all()


def test_champions_are_tried_again_with_their_partners(folder: ResultsFolder) -> None:
    """The first of their trials is compared with the recorded one."""
    for champions in retry_champions(folder)[:2]:
        assert champions.problem == ""
        assert champions.fresh.shape == (4, 20)


def test_champion_drives_one_robot_alone(folder: ResultsFolder, tmp_path: Path) -> None:
    file = tmp_path / "champion.json"
    for name in ("one", "each", "avoid"):
        command("export", folder.path, "--condition", name, "-o", file)
        tried = json.loads(command("try", file, "--on", "sim", "--steps", 20, "--json"))
        assert 0 < tried["coverage"][0] < 1
    sides = compare_trials(folder.path, against="jyro", condition="each", repeats=2)
    assert len(sides) == 2
    found = sample_controllers(folder.path, 3, seed=1)
    assert all(0 < controller.fresh_score < 1 for controller in found if controller.fresh_score is not None)


def test_transfer_takes_one_robot() -> None:
    with pytest.raises(StudyError, match="has 3 robots in the arena, expected 1"):
        choose_condition(parse_study(STUDY, "several.toml"), "one", 1)


def test_partners_are_in_the_records(folder: ResultsFolder) -> None:
    rows = folder.read("each")
    assert rows["partners"].list.len().unique().to_list() == [2]
    assert "partners" not in folder.read("one").columns
    assert rows.filter(pl.col("fitness") != pl.col("coverage_line")).height > 0
