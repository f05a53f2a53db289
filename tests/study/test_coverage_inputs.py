"""Coverage by networks with other inputs than the paper's, on each platform that has them."""

from __future__ import annotations

from pathlib import Path

import pytest

from realitygap.errors import StudyError
from realitygap.records import ResultsFolder
from realitygap.runs import Condition, genome_of
from realitygap.study import parse_study, run_study, sample_controllers

from .physical import drive

INPUTS = ("range.0", "range.1", "time")
TASK = '[task]\ninputs = ["range.0", "range.1", "time"]\n'


def test_paper_inputs_by_default_keep_the_hash_and_others_change_it() -> None:
    paper = Condition(name="a")
    assert "inputs" not in paper.settings()["task"]
    other = Condition(name="a", platform="sim", task={"inputs": INPUTS})
    assert other.network_inputs == INPUTS
    assert other.settings()["task"]["inputs"] == list(INPUTS)
    assert Condition.from_settings("a", other.settings()).hash() == other.hash()
    with_constant = Condition(name="a", platform="sim", selection="novelty", task={"inputs": INPUTS})
    assert with_constant.network_inputs == (*INPUTS, "bias")
    same = Condition(name="a", task={"inputs": ["obstacle", "stall", "time"]})
    assert same.hash() == paper.hash()


@pytest.mark.parametrize(
    ("task", "platform", "message"),
    [
        ({"inputs": ["range.3"]}, "jyro", r"range\.3 is missing"),
        ({"inputs": ["light.0"]}, "jyro", r"light\.0 is missing"),
        ({"inputs": ["range.3"]}, "scribbler", "range.3 is missing"),
        ({"inputs": ["light.3"]}, "scribbler", "light.3 is missing"),
        ({"inputs": ["range.0", "bias"]}, "sim", "expected none named bias. Set bias_input"),
        ({"inputs": []}, "sim", "inputs: expected at least 1, got 0"),
    ],
)
def test_inputs_that_a_platform_lacks_are_refused(task: dict, platform: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Condition(name="a", platform=platform, task=task)


def test_robot_is_driven_by_networks_with_single_sensors(tmp_path: Path) -> None:
    study = parse_study(TASK + _SMALL, "small.toml")
    result = drive(study, tmp_path / "small")
    assert result.n_complete == 1
    folder = ResultsFolder.open(tmp_path / "small")
    row = folder.scan().collect().row(0, named=True)
    genome = genome_of(study.conditions[0], row)
    assert genome.interface.inputs == INPUTS
    assert genome.network().n_inputs == 3


_SMALL = """
[study]
name = "small"
replicates = 1
[neat]
population = 3
generations = 2
[platform.scribbler]
steps = 4
[[condition]]
name = "robot"
platform = "scribbler"
"""


@pytest.mark.slow
def test_champions_keep_their_inputs_and_meet_targets_that_lack_them(tmp_path: Path) -> None:
    study = parse_study(TASK + _SMALL.replace("scribbler", "sim"), "small.toml")
    folder = run_study(study, tmp_path / "sim", threads=1).folder
    (champion,) = sample_controllers(folder.path, 1, 1)
    assert champion.genome.interface.inputs == INPUTS
    with pytest.raises(StudyError, match="has no champions, because its conditions have no selection"):
        sample_controllers(_random(tmp_path), 1, 1)


def _random(tmp_path: Path) -> Path:
    text = TASK + _SMALL.replace("scribbler", "sim") + 'selection = "random"\n'
    return run_study(parse_study(text, "small.toml"), tmp_path / "random", threads=1).folder.path
