"""The gap in the score of any task, and who has to see it."""

import json
import re

import numpy as np
import pytest

from realitygap.errors import ControllerError, StudyError, TaskError
from realitygap.report import write_gap_report
from realitygap.study import gap_between, plan_gap, run_study, sample_controllers, task_named

pytestmark = pytest.mark.slow

STUDY = """
[study]
name = "av"
replicates = 6
[neat]
population = 12
generations = 3
[task]
kind = "{kind}"
inputs = ["range.0", "range.1", "range.2", "bias"]
[arena]
preset = "{arena}"
[[condition]]
name = "one"
platform = "sim"
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Folders of results, by the kind of their task."""
    folder = tmp_path_factory.mktemp("results")
    found = {}
    for kind, arena in (("avoid", "paper"), ("light", "light")):
        file = folder / f"{kind}.toml"
        file.write_text(STUDY.format(kind=kind, arena=arena))
        found[kind] = run_study(file, folder / kind).folder.path
    return found


def test_champions_bring_their_task_their_arena_and_their_luck(results, tmp_path):
    for kind, arena in (("avoid", "paper"), ("light", "light")):
        found = gap_between("sim", "sim", controllers=results[kind], n_controllers=5, trials=2)
        assert found.study.task.name == kind
        assert found.study.arena.name == arena
        assert found.study.result.luck.value is not None
        champions = found.study.controllers
        assert found.study.source.means == pytest.approx([each.fresh_score for each in champions], abs=0.15)
        page = write_gap_report(found, tmp_path / "gap.html").read_text()
        assert found.study.task.score_name in page
        assert not re.search("(Mean|in|of) coverage", page)


def test_json_names_the_score_where_it_is_not_coverage(results):
    found = gap_between("sim", "sim", controllers=results["avoid"], n_controllers=2, trials=1).study.result
    assert json.loads(found.to_json())["score"] == "avoidance score"
    plain = gap_between("sim", "sim", n_controllers=2, trials=1).study.result
    assert "score" not in json.loads(plain.to_json())


def test_another_task_scores_controllers_that_were_selected_for_something_else(results):
    found = gap_between(
        "sim", "sim", controllers=results["avoid"], task="wall", n_controllers=3, trials=2
    ).study
    assert found.result.score == "distance along walls [m]"
    assert "selected for another score" in found.result.luck.refused
    assert np.abs(found.source.values).max() > 0


def test_trials_that_were_kept_are_scored_anew_by_another_task(tmp_path):
    kept = tmp_path / "kept.sqlite"
    first = gap_between(
        "sim", "sim", task="avoid", n_controllers=3, trials=2, observe="track", results=kept
    ).study
    again = gap_between("sim", f"recorded:{kept}", task="avoid").study
    assert again.target.values.tolist() == first.target.values.tolist()
    assert gap_between("sim", f"recorded:{kept}", task="wall").study.result.score == (
        "distance along walls [m]"
    )
    assert gap_between("sim", f"recorded:{kept}").study.result.score == "coverage"


@pytest.mark.parametrize(
    ("values", "error", "text"),
    [
        ({"task": "lihgt"}, StudyError, "Did you mean 'light'"),
        ({"task": "light", "arena": "paper"}, TaskError, "arena 'paper' has none"),
        (
            {"task": "wall", "observe": "cells"},
            StudyError,
            "task 'wall' is scored by its poses. Use observe track",
        ),
        ({"task": "python:none.py:f"}, TaskError, "none.py cannot be read"),
        ({"controllers": "avoid"}, ControllerError, r"range\.3 to range\.7 are missing"),
    ],
)
def test_tasks_and_controllers_that_cannot_be_scored_are_refused_before_a_trial(values, error, text):
    with pytest.raises(error, match=text):
        gap_between("sim", "sim", n_controllers=2, trials=1, **values)


def test_a_target_that_shows_too_little_is_refused_with_who_would_see_it(tmp_path):
    kept = tmp_path / "kept.sqlite"
    gap_between("sim", "sim", n_controllers=2, trials=1, observe="cells", results=kept)
    with pytest.raises(StudyError, match=r"supports at most 'cells'\. Use a camera, or the witness"):
        gap_between("sim", f"recorded:{kept}", task="wall")


def test_a_python_task_scores_only_if_it_is_allowed(tmp_path, monkeypatch):
    monkeypatch.setenv("REALITYGAP_STATE", str(tmp_path / "state"))
    file = tmp_path / "still.py"
    file.write_text("def score(trials):\n    return -abs(trials.commands).sum(axis=(1, 2))\n")
    with pytest.raises(TaskError, match="you have not allowed this file"):
        gap_between("sim", "sim", task=f"python:{file}:score", n_controllers=2, trials=1)
    found = gap_between(
        "sim", "sim", task=f"python:{file}:score", n_controllers=2, trials=1, allow_code=True
    ).study
    assert found.result.score == "score of score"
    assert (found.source.values <= 0).all()


def test_a_plan_is_in_the_units_of_a_task():
    light = plan_gap("effect", 0.05, task=task_named("light"), arena="light", trials=[2])
    coverage = plan_gap("effect", 0.05, trials=[2])
    assert light.spreads.noise != coverage.spreads.noise
    with pytest.raises(TaskError, match="has none"):
        plan_gap("effect", 0.05, task=task_named("light"), trials=[2])


def test_champions_of_the_first_task_are_drawn(results):
    (champion,) = sample_controllers(results["light"], 1)
    assert champion.condition.task_of_trials.name == "light"
    assert champion.selected_on == "sim"
