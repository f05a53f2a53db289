"""An archive is filled by numbers of a Python function, which the user allows as that of a task."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realitygap.errors import RecordError, StudyError, TaskError
from realitygap.platforms import SimPlatform, SimTarget
from realitygap.report import draw_elites, save_view
from realitygap.report._tally import read_tally
from realitygap.runs import Condition, elites_of, retry_elites, run_replicates
from realitygap.study import load_study, run_study, sample_controllers, transfer
from realitygap.study._transfer.noise import changed_condition
from realitygap.tasks import PythonDescriptor
from realitygap.tasks._python import _load
from realitygap.world import paper_arena

SOURCE = """
import math
from pathlib import Path

import numba
import numpy as np


def mean_move(trajectories):
    return np.abs(trajectories.commands[:, :, 0]).mean(axis=1)


@numba.njit
def compiled(arrays, step_s, found):
    for k in range(len(found)):
        found[k] = np.abs(arrays.commands[:, 0, k].astype(np.float64)).mean()


def motion(trajectories):
    return np.stack([trajectories.commands[:, :, 1].mean(axis=1), mean_move(trajectories)], axis=1)


def short(trajectories):
    return [0.5]


def infinite(trajectories):
    return np.full(len(trajectories), math.inf)


def leaving(trajectories):
    raise SystemExit(0)
"""
STUDY = """
[study]
name = "mine"
replicates = 2
[neat]
population = 12
generations = 4
[archive]
descriptor = ["own", "stall_share"]
cells = [6, 4]
[archive.own]
kind = "python:own.py:mean_move"
names = ["my_move"]
ranges = [[0, 1]]
[[condition]]
name = "a"
platform = "sim"
selection = "map-elites"
"""


@pytest.fixture
def study(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("REALITYGAP_STATE", str(tmp_path / "state"))
    (tmp_path / "own.py").write_text(SOURCE)
    path = tmp_path / "s.toml"
    path.write_text(STUDY)
    return path


def condition_of(
    descriptor: list[str], cells: list[int], folder: Path | None = None, **own: Any
) -> Condition:
    archive: dict[str, Any] = {"descriptor": descriptor, "cells": cells}
    if folder is not None:
        kind = f"python:{folder}/own.py:{own.pop('function')}"
        archive["own"] = PythonDescriptor.from_file(kind, **own).allowed()
    neat = {"population": 20, "generations": 4}
    values = {"name": "c", "platform": "sim", "selection": "map-elites", "neat": neat, "archive": archive}
    return Condition.model_validate(values)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("descriptor", "cells", "function", "names", "same"),
    [
        (["own", "end"], [6, 4, 3], "mean_move", ["moved"], ["mean_move", "end"]),
        (["own", "end"], [6, 4, 3], "compiled", ["moved"], ["mean_move", "end"]),
        (["own"], [7, 5], "motion", ["turned", "moved"], ["mean_turn", "mean_move"]),
    ],
)
def test_archives_are_those_of_the_built_in_descriptor(study, descriptor, cells, function, names, same):
    ranges = [[-1, 1], [0, 1]][-len(names) :]
    mine = condition_of(descriptor, cells, study.parent, function=function, names=names, ranges=ranges)
    known = condition_of(same, cells)
    assert mine.descriptor_names == (*names, *known.descriptor_names[len(names) :])
    found, expected = (run_replicates(each, 0, 2) for each in (mine, known))
    columns = ["fitness", "parents"]
    assert found.select(columns).equals(expected.select(columns))
    a, b = (np.array(frame["descriptor"].to_list()) for frame in (found, expected))
    assert a == pytest.approx(b, abs=1e-6)
    again = [retry_elites(one, elites_of(one, frame), 3) for one, frame in ((mine, found), (known, expected))]
    assert again[0]["again_cell"].equals(again[1]["again_cell"])


@pytest.mark.slow
def test_a_study_runs_reports_and_resumes_with_permission_only(study):
    out = study.parent / "out"
    with pytest.raises(TaskError, match=r"own\.py:mean_move runs the code of a Python file"):
        run_study(study, out)
    assert not out.exists()
    run_study(study, out, allow_code=True)

    assert "The archive is not corrected: that runs python:own.py:mean_move" in draw_elites(out).caption
    plain = save_view(out, study.parent / "a.svg", subject="archive").read_text()
    allowed = save_view(out, study.parent / "b.svg", subject="archive", allow_code=True).read_text()
    assert re.search(r"not\s+corrected", plain)
    assert not re.search(r"not\s+corrected", allowed)

    run_study(study, out, replicates=3, allow_code=True)
    (study.parent / "own.py").write_text(SOURCE + "# changed\n")
    with pytest.raises(StudyError, match="the text of the Python file has SHA-256"):
        run_study(study, out, replicates=4, allow_code=True)


@pytest.mark.slow
def test_only_runs_need_permission_for_descriptors(study):
    run_study(study, study.parent / "out", allow_code=True)
    assert len(sample_controllers(study.parent / "out", 2)) == 2
    with pytest.raises(TaskError, match="not allowed"):
        sample_controllers(study, 1)


def test_reading_results_gives_no_permission(study):
    condition = load_study(study).conditions[0]
    again = Condition.from_settings("a", condition.allowed().settings())
    assert [function.may_run for function in again.functions] == [False]
    with pytest.raises(TaskError, match="not allowed"):
        run_replicates(again, 0, 1)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('["own", "stall_share"]', '["end"]', "expected 'own' among the descriptors"),
        ("[archive.own]\n", "[arena]\n[archive.other]\n", "archive.other: unknown setting"),
        ('names = ["my_move"]', 'names = ["my_move", "other"]', "got 2 for names and 1 for ranges"),
        ('names = ["my_move"]', 'names = ["My move"]', "the name 'My move' is none"),
        ('names = ["my_move"]', 'names = ["mean_turn"]', "'mean_turn', which is a number of realitygap"),
        ('names = ["my_move"]\n', "", "names: missing"),
        ("[[0, 1]]", "[[1, 0]]", "my_move is from 1 to 0"),
        ("[[0, 1]]", "[[0, inf]]", "ranges"),
        ("[[0, 1]]", "[[-1e308, 1e308]]", "expected a width from"),
        ("[[0, 1]]", "[0, 1]", "ranges"),
        ("python:own.py:mean_move", "python:none.py:mean_move", "none.py cannot be read"),
        (
            "python:own.py:mean_move",
            "python:own.py",
            "kind: expected python:FILE.py:FUNCTION, got 'python:own.py'",
        ),
        (
            "[archive.own]",
            '[archive.own]\nsource = "code"',
            "archive.own.source: code in a study file is not run",
        ),
    ],
)
def test_mistakes_in_the_file_are_named(study, old, new, says):
    assert STUDY.count(old) == 1
    study.write_text(STUDY.replace(old, new))
    with pytest.raises(StudyError, match=re.escape(says)):
        load_study(study)


@pytest.mark.parametrize(
    ("function", "says"),
    [
        ("short", r"shape \(1,\), expected \(\d+,\): one number for each trial"),
        ("infinite", "returned inf for trial 0, expected finite numbers"),
        ("nothing", "has no function 'nothing'"),
        ("leaving", r"leaving of own\.py failed: line \d+: SystemExit: 0"),
        ("motion", r"shape \(\d+, 2\), expected"),
    ],
)
def test_mistakes_of_the_function_are_named(study, function, says):
    condition = condition_of(["own"], [5], study.parent, function=function, names=["x"], ranges=[[0, 1]])
    with pytest.raises(TaskError, match=says):
        run_replicates(condition, 0, 1)


def test_numbers_out_of_range_are_moved_to_its_end(study):
    low, high = 0.4, 0.6
    condition = condition_of(
        ["own"], [5], study.parent, function="mean_move", names=["x"], ranges=[[low, high]]
    )
    free = condition_of(["own"], [5], study.parent, function="mean_move", names=["x"], ranges=[[0, 1]])
    values, all_values = (
        run_replicates(each, 0, 1).filter(generation=0)["descriptor"].explode().to_numpy()
        for each in (condition, free)
    )
    assert all_values.min() < low
    assert all_values.max() > high
    assert values.tolist() == np.clip(all_values, low, high).tolist()


@pytest.mark.slow
def test_a_function_that_fails_leaves_the_archive_as_found(study):
    """It was allowed before, and asks the machine it runs on."""
    (study.parent / "own.py").write_text(
        SOURCE + f"\nif Path({str(study.parent / 'gone')!r}).exists():\n    raise OSError('gone')\n"
    )
    run_study(study, study.parent / "out", allow_code=True)
    tally = read_tally(study.parent / "out", allow_code=True)
    assert "(corrected)" in draw_elites(tally).caption
    (study.parent / "gone").touch()
    _load.cache_clear()
    caption = draw_elites(tally).caption
    assert re.search(r"is not corrected: own\.py cannot be run: line \d+: OSError: gone", caption)


@pytest.mark.parametrize("selection", ["map-elites", "fitness"])
def test_a_changed_simulator_keeps_the_archive_and_its_permission(study, selection):
    """Strategies that suspect damages filled archives by the default descriptors, or were not allowed to."""
    condition = load_study(study).conditions[0].allowed().model_copy(update={"selection": selection})
    changed = changed_condition(condition, "weak", set={"drive.gain_left": 0.5})
    assert changed.archive == condition.archive
    assert [function.may_run for function in changed.functions] == [True]


def test_a_transfer_belongs_to_its_archive(study, tmp_path):
    arena, out = paper_arena(), tmp_path / "t"
    options = {"budget": 1, "out": out, "runs": 1, "repeats": 1, "fresh_trials": 1, "allow_code": True}
    study.write_text(STUDY.replace('selection = "map-elites"', ""))
    transfer(study, SimTarget(SimPlatform(), arena, key=1, name="other"), "plain", **options)
    (study.parent / "own.py").write_text(SOURCE + "# changed\n")
    with pytest.raises(RecordError, match="the condition has other settings"):
        transfer(study, SimTarget(SimPlatform(), arena, key=1, name="other"), "plain", **options)


def test_conditions_without_a_function_keep_their_settings():
    assert "own" not in condition_of(["end"], [5, 5]).settings()["archive"]
