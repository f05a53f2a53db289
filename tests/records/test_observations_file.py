"""Observed trials as lines of JSON."""

from __future__ import annotations

import contextlib
import json
import math
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from realitygap.errors import RecordError
from realitygap.records import (
    ObservationsHead,
    RecordWarning,
    TrialRecord,
    open_saved_trials,
    read_observations,
    trial_to_dict,
    write_observations,
)
from realitygap.world import paper_arena

HEAD = ObservationsHead(
    "twin:worn.toml", "TWIN", "scribbler-s2-fluke2", paper_arena().to_dict(), 0.5, "track"
)


def trial(number: int, t: int = 3) -> TrialRecord:
    rng = np.random.default_rng(number)
    return TrialRecord(
        start=(0.19, 0.2, math.pi / 7),
        step_s=0.5,
        commands=rng.uniform(-1, 1, (t, 2)),
        readings=rng.uniform(0, 1, (t, 3)),
        stalled=rng.random(t) < 0.5,
        cells=(3, 7, 71),
        wheels=rng.normal(size=(t + 1, 2)),
        poses=rng.normal(size=(t + 1, 3)),
        number=number,
        purpose="motion",
        battery_v=float("nan") if number else 7.25,
    )


def robot_trial(number: int) -> TrialRecord:
    """A trial of a robot, which knows when it looked and what its sensors answered in their own units."""
    rng = np.random.default_rng(number)
    looks = {"times": np.cumsum(rng.uniform(0.4, 0.6, 4)), "raw": rng.integers(0, 6400, (4, 3)).astype(float)}
    return replace(trial(number), last_readings=np.ones(3), last_stalled=True, problem="no answer", **looks)


def same(one: TrialRecord, other: TrialRecord) -> bool:
    return trial_to_dict(one) == trial_to_dict(other)


def test_trials_come_back_as_they_were(tmp_path: Path) -> None:
    trials = [
        trial(0),
        trial(1, 0),
        replace(trial(2), wheels=np.empty((0, 2)), poses=np.empty((0, 3)), cells=()),
        robot_trial(3),
    ]
    write_observations(tmp_path / "one.jsonl", HEAD, trials)
    found = read_observations(tmp_path / "one.jsonl")
    assert found.head.to_dict() == HEAD.to_dict()
    assert found.problem == ""
    assert all(same(*pair) for pair in zip(found.trials, trials, strict=True))
    assert found.trials[2].observe == "cells"
    assert (found.trials[3].times.shape, found.trials[3].raw.shape) == ((4,), (4, 3))
    assert math.isnan(found.trials[1].battery_v)
    assert found.trials[0].commands.dtype == float
    assert found.trials[0].stalled.dtype == bool


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(cut=st.integers(0, 3000), more=st.booleans())
def test_a_file_cut_off_anywhere_keeps_all_whole_trials_and_can_be_converted(
    tmp_path: Path, cut: int, more: bool
) -> None:
    path = tmp_path / "cut.jsonl"
    trials = [trial(number, 2) for number in range(3)]
    write_observations(path, HEAD, trials)
    whole = path.read_bytes()
    ends = np.cumsum([len(line) for line in whole.splitlines(keepends=True)])
    cut = min(cut, len(whole))
    path.write_bytes(whole[:cut])
    n_whole = int(np.sum(ends[1:] - 1 <= cut))  # without its newline a line is whole, too
    if cut >= ends[0] - 1:
        found = read_observations(path)
        assert [each.number for each in found.trials] == list(range(n_whole))
        assert ("cut off" in found.problem) == (cut not in ends and cut + 1 not in ends)
    else:
        with pytest.raises(RecordError, match="not a file of observed trials"):
            read_observations(path)
    if cut < ends[0] - 1:
        return
    path.with_suffix(".sqlite").unlink(missing_ok=True)
    with warnings.catch_warnings(), contextlib.ExitStack() as stack:
        warnings.simplefilter("ignore", RecordWarning)
        ledger = stack.enter_context(open_saved_trials(path, HEAD))
        assert len(ledger.observations().trials) == n_whole
        if more:
            ledger.append(trial(9, 2))
    expected = [*range(n_whole), *([9] if more else [])]
    assert [each.number for each in read_observations(ledger.path).trials] == expected
    assert path.read_bytes() == whole[:cut]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"", "not a file of observed trials"),
        (b'{"a": 1}\n{"b": 2}\n', "not a file of observed trials"),
        (b"\xff\xfe\x00binary", "not a file of observed trials"),
        (b'{"format": "realitygap observations 9"}\n', "or of another version"),
        (b'{"format": "realitygap observations 1"}\n', "has no target, label, robot, arena, step_s, observe"),
    ],
)
def test_another_file_is_refused_and_stays_as_it_is(tmp_path: Path, text: bytes, said: str) -> None:
    path = tmp_path / "other.jsonl"
    path.write_bytes(text)
    with pytest.raises(RecordError, match=said):
        read_observations(path)
    with pytest.raises(RecordError):
        open_saved_trials(path, HEAD)
    assert path.read_bytes() == text


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"readings": [[0.1]]}, "a trial with 3 commands whose readings are of 1"),
        ({"poses": [[1, 2]]}, "a trial that cannot be read"),
        ({"cells": "many"}, "a trial that cannot be read"),
        ({"end": ...}, "a trial without 'end'"),
        ({"readings": [[0.1, None, 0.2]] * 3}, "a trial whose readings are not all numbers"),
        ({"start": [0.1, float("nan"), 0.0]}, "a trial whose start are not all numbers"),
    ],
)
def test_damage_before_the_last_line_is_told_with_its_line(
    tmp_path: Path, change: dict[str, object], said: str
) -> None:
    path = tmp_path / "one.jsonl"
    write_observations(path, HEAD, [trial(0), trial(1)])
    lines = path.read_text().splitlines()
    values = {**json.loads(lines[1]), **change}
    lines[1] = json.dumps({name: value for name, value in values.items() if value is not ...})
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordError, match=f"line 2 is {said}"):
        read_observations(path)


def test_a_file_that_is_not_there_is_told_in_one_message(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="There is no file"):
        read_observations(tmp_path / "none.jsonl")
