"""Studies on the platform `sim`: files, resume, digests, what the records and the page say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import polars as pl
import pytest

import realitygap
from realitygap.errors import RecordError, StudyError
from realitygap.records import ResultsFolder
from realitygap.report import save_view, write_report
from realitygap.runs import Condition, replay, run_replicates
from realitygap.study import Study, load_study, parse_study, run_study
from realitygap.tasks import PythonTask

STUDY = """
[study]
name = "drawn"
replicates = 12

[platform.sim]
steps = 20

[platform.sim.set]
"drive.track" = { normal = [0.153, 0.002], per = "run" }
"contact.friction" = { uniform = [0.1, 0.5] }

[[condition]]
name = "objective"
platform = "sim"

[[condition]]
name = "novel"
platform = "sim"
selection = "novelty"
noise = 0.1

[condition.novelty]
distance = "final"

[condition.sim]
contact = "freeze"

[condition.sim.set]
"drive.track" = 0.15

[[condition]]
name = "jyro"
"""


def study(text: str = STUDY) -> Study:
    return parse_study(text, "drawn.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> ResultsFolder:
    return run_study(study(), tmp_path_factory.mktemp("sim") / "drawn", threads=1).folder


def test_digest_does_not_depend_on_threads_chunks_or_interruption(folder, tmp_path):
    out = tmp_path / "drawn"
    few = STUDY.replace("replicates = 12", "replicates = 5")
    run_study(study(few), out, threads=2, chunk=2)
    resumed = run_study(study(), out, threads=2, chunk=3)
    assert resumed.n_computed == 21
    assert resumed.folder.digest() == folder.digest()
    changed = STUDY.replace("0.5] }", "0.6] }")
    with pytest.raises(StudyError, match=r"contact\.friction"):
        run_study(study(changed), out)


def test_sampled_numbers_are_in_the_records_under_names_of_the_description(folder):
    about = {each["name"]: each for each in folder.description["conditions"]}
    assert about["objective"]["drawn"] == ["contact.friction", "drive.track"]
    assert about["novel"]["drawn"] == ["contact.friction"]
    assert "drawn" not in about["jyro"]
    rows = folder.read("objective", columns=["replicate", "drawn"]).with_columns(
        pl.col("drawn").list.to_struct(fields=about["objective"]["drawn"]).struct.unnest()
    )
    assert rows["contact.friction"].n_unique() == rows.height
    assert rows["contact.friction"].is_between(0.1, 0.5).all()
    per_run = rows.group_by("replicate").agg(pl.col("drive.track").n_unique())
    assert per_run["drive.track"].to_list() == [1] * 12
    assert rows["drive.track"].n_unique() == 12
    # of the same name, key, run and trial the same is drawn in both conditions
    novel = folder.read("novel", columns=["drawn"])["drawn"].list.first()
    assert novel.equals(rows["contact.friction"].alias("drawn"))
    assert folder.read("novel")["behavior"].list.len().unique().to_list() == [2]


@pytest.mark.slow
def test_every_trial_comes_out_again_from_its_row(folder):
    for condition in study().conditions:
        rows = folder.read(condition.name, [3])
        for row in rows.iter_rows(named=True):
            trial = replay(condition, row)
            assert list(trial.cells) == row["cells"]
            if condition.name == "novel":
                assert trial.poses[-1, :2] == pytest.approx(row["behavior"], abs=1e-12)
    row = folder.read("objective").row(0, named=True)
    row["drawn"] = [row["drawn"][0], 0.2]
    with pytest.raises(RecordError, match=r"contact\.friction, drive\.track is drawn otherwise"):
        replay(study().conditions[0], row)


def test_settings_hold_the_robot_and_make_the_condition_again(tmp_path):
    robot = tmp_path / "mine.toml"
    robot.write_text('base = "scribbler-s2"\n[drive]\nspeed = 0.12\n')
    text = '[study]\nname = "x"\n[[condition]]\nname = "a"\nplatform = "sim:mine.toml"\n'
    (tmp_path / "x.toml").write_text(text)
    (condition,) = load_study(tmp_path / "x.toml").conditions
    settings = condition.settings()
    assert settings["sim"]["robot"]["drive"]["speed"] == 0.12
    assert Condition.from_settings("a", settings).hash() == condition.hash()
    robot.write_text('base = "scribbler-s2"\n[drive]\nspeed = 0.13\n')
    (changed,) = load_study(tmp_path / "x.toml").conditions
    assert changed.hash() != condition.hash()


def test_conditions_of_before_keep_their_hash():
    """They are what studies on disk were run with."""
    assert Condition(name="a").hash().startswith("88619d669239056a")


@pytest.mark.slow
def test_the_page_says_what_was_assumed_and_draws_trials(folder, tmp_path):
    page = Path(write_report(folder, tmp_path / "page.html")).read_text("utf-8")
    assert "Assumed of objective" in page
    assert "drive.track normal (0.153, 0.002) per run" in page
    assert "contact freeze: a blocked robot does not move at all" in page
    assert "cannot be recomputed" not in page
    for subject in ("run", "network"):
        out = save_view(folder, tmp_path / f"{subject}.svg", subject=subject, condition="objective")
        assert out.stat().st_size > 1000


PYTHON_TASK = """
import numpy as np

def far(trajectories):
    way = np.linalg.norm(np.diff(trajectories.poses[..., :2], axis=1), axis=2).sum(axis=1)
    return way + 0.1 * trajectories.wheels[:, -1].mean(axis=1)

def wrong_shape(trajectories):
    return 1.0

def no_number(trajectories):
    return np.full(len(trajectories), np.nan)

def fails(trajectories):
    return trajectories.speed
"""

COMPILED_TASK = """
import numba
import numpy as np

@numba.njit
def far(arrays, step_s, fitness):
    poses = arrays.poses
    for k in range(fitness.size):
        way = 0.0
        for step in range(1, poses.shape[0]):
            x = np.float64(poses[step, 0, k]) - np.float64(poses[step - 1, 0, k])
            y = np.float64(poses[step, 1, k]) - np.float64(poses[step - 1, 1, k])
            way += np.sqrt(x * x + y * y)
        wheels = arrays.wheels
        fitness[k] = way + 0.05 * (np.float64(wheels[-1, 0, k]) + np.float64(wheels[-1, 1, k]))
"""


def with_task(tmp_path: Path, source: str, function: str = "far", **settings: Any) -> Condition:
    (tmp_path / "task.py").write_text(source)
    task = PythonTask.from_file(f"python:{tmp_path}/task.py:{function}").allowed()
    values = {"name": "t", "platform": "sim", "task": task, **settings}
    steps = {"sim": {"steps": 15}} if values["platform"] == "sim" else {}
    return Condition(**{**steps, **values})


def test_a_function_of_ones_own_decides_who_has_children(tmp_path):
    condition = with_task(tmp_path, PYTHON_TASK)
    assert condition.selection == "fitness"
    rows = run_replicates(condition, 0, 6)
    assert rows["fitness"].equals(rows["task_fitness"].alias("fitness"))
    for row in rows.head(40).iter_rows(named=True):
        trial = replay(condition, row)
        steps = trial.poses[1:, :2] - trial.poses[:-1, :2]
        way = (steps**2).sum(axis=1) ** 0.5
        assert row["fitness"] == pytest.approx(way.sum() + 0.1 * trial.wheels[-1].mean(), rel=1e-12)
    novel = run_replicates(with_task(tmp_path, PYTHON_TASK, selection="novelty"), 0, 1)
    assert novel["novelty"].equals(novel["fitness"].alias("novelty"))
    assert not novel["task_fitness"].equals(novel["fitness"].alias("task_fitness"))


@pytest.mark.slow
def test_a_compiled_function_reads_the_kernels_arrays_and_says_the_same(tmp_path):
    plain = run_replicates(with_task(tmp_path, PYTHON_TASK), 0, 2)
    compiled = run_replicates(with_task(tmp_path, COMPILED_TASK), 0, 2)
    first = pl.col("generation") == 0
    assert compiled.filter(first)["fitness"].to_list() == pytest.approx(
        plain.filter(first)["fitness"].to_list(), rel=1e-6
    )


@pytest.mark.slow
def test_portions_of_trials_of_which_every_step_is_kept_change_nothing(tmp_path, monkeypatch):
    condition = with_task(tmp_path, PYTHON_TASK)
    whole = run_replicates(condition, 0, 9)
    monkeypatch.setattr("realitygap.platforms._try.TRACE_BYTES", 1)
    assert run_replicates(condition, 0, 9).equals(whole)


def test_the_text_of_the_file_is_part_of_the_condition(tmp_path):
    one, same = (with_task(tmp_path, PYTHON_TASK).hash() for _ in range(2))
    assert one == same
    other = with_task(tmp_path, PYTHON_TASK + "\n# changed\n")
    assert other.hash() != one
    (tmp_path / "task.py").unlink()
    assert Condition.from_settings("t", other.settings()).hash() == other.hash()
    assert run_replicates(other, 0, 1).height == 40


def test_conditions_of_python_tasks_keep_their_hash(tmp_path):
    """They are what studies on disk were run with."""
    condition = with_task(tmp_path, PYTHON_TASK)
    assert condition.hash().startswith("c40b8def978e53fc")


@pytest.mark.parametrize(
    ("function", "text"),
    [
        ("fails", "fails of task.py failed: line 15: AttributeError"),
        ("wrong_shape", r"wrong_shape of task.py returned an array of shape \(\), expected \(320,\)"),
        ("no_number", "no_number of task.py returned nan for trial 0, expected finite numbers"),
    ],
)
def test_a_function_that_fails_gives_one_message(tmp_path, function, text):
    condition = with_task(tmp_path, PYTHON_TASK, function)
    with pytest.raises(StudyError, match=text):
        run_replicates(condition, 0, 40)


@pytest.mark.parametrize(
    ("task", "text"),
    [
        ('kind = "python:no.py:f"', "no.py cannot be read: No such file"),
        ('kind = "python:folder.py:f"', "folder.py cannot be read: it is not a plain file"),
        ('kind = "python:latin.py:f"', "latin.py cannot be read: 'utf-8' codec"),
        ('kind = "python:no-function.py"', "task.kind: expected"),
        ('kind = "fly"', "task.kind: unknown kind 'fly'. Known: avoid"),
        ('kind = "python:task.py:far"\nsource = "code"', "task.source: code in a study file is not run"),
        (
            'kind = "python:task.py:far"\n[condition.task]\nsource = "code"',
            "task.source: code in a study file",
        ),
        ('source = "code"', "task.source: code in a study file is not run"),
    ],
)
def test_a_task_that_is_not_there_is_one_mistake(tmp_path, task, text):
    (tmp_path / "task.py").write_text(PYTHON_TASK)
    (tmp_path / "folder.py").mkdir()
    (tmp_path / "latin.py").write_bytes(b"# \xe4")
    path = tmp_path / "s.toml"
    task, bracket, below = task.partition("[")
    condition = f'[[condition]]\nname = "a"\nplatform = "sim"\n{bracket}{below}\n'
    path.write_text(f'[study]\nname = "s"\n[task]\n{task}\n{condition}')
    with pytest.raises(StudyError, match="has 1 mistake") as raised:
        load_study(path)
    assert text in str(raised.value)


def test_another_task_than_coverage_needs_what_jyro_has(tmp_path):
    with pytest.raises(ValueError, match="selection is 'coverage', which is another task"):
        with_task(tmp_path, PYTHON_TASK, selection="coverage")
    condition = with_task(tmp_path, PYTHON_TASK, platform="jyro")
    with pytest.raises(StudyError, match=r"far of task\.py failed: line 6: ValueError: These trials"):
        run_replicates(condition, 0, 1)


def test_the_line_that_reads_rows_with_several_columns_reads_them(tmp_path):
    """polars refuses to scan files of which some lack a column."""
    from realitygap.cli._study import _reading

    text = '[study]\nname = "mix"\nreplicates = 1\n[[condition]]\nname = "a"\nplatform = "sim"\nnoise = 0\n'
    text += '[condition.sim]\nsteps = 3\n[[condition]]\nname = "b"\n'
    folder = run_study(parse_study(text, "mix"), tmp_path / "mix").folder
    rows = eval(_reading(folder), {"realitygap": realitygap}).collect()
    assert set(rows["condition"]) == {"a", "b"}
