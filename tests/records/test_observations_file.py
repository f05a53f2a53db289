"""The file of observed trials."""

from __future__ import annotations

import json
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from realitygap.errors import RecordError
from realitygap.records import (
    ObservationsFile,
    ObservationsHead,
    TrialRecord,
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


def test_a_trial_is_on_the_disk_when_append_returns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(os.fstat(descriptor).st_size))
    with ObservationsFile(tmp_path / "one.jsonl", HEAD) as file:
        for number in range(3):
            file.append(trial(number))
            assert synced[-1] == file.path.stat().st_size
            assert len(read_observations(file.path).trials) == number + 1


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(cut=st.integers(0, 3000), more=st.booleans())
def test_a_file_cut_off_anywhere_keeps_all_whole_trials_and_can_be_taken_up(
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
    with ObservationsFile(path, HEAD) as file:
        assert len(file.trials) == n_whole
        if more:
            file.append(trial(9, 2))
    expected = [*range(n_whole), *([9] if more else [])]
    again = read_observations(path)
    assert [each.number for each in again.trials] == expected
    assert again.problem == ""


@pytest.mark.parametrize("n", [0, 2])
def test_a_line_without_its_end_is_not_run_into_the_next_one(tmp_path: Path, n: int) -> None:
    path = tmp_path / "cut.jsonl"
    write_observations(path, HEAD, [trial(number, 2) for number in range(n)])
    path.write_bytes(path.read_bytes()[:-1])
    with ObservationsFile(path, HEAD) as file:
        file.append(trial(9, 2))
    assert [each.number for each in read_observations(path).trials] == [*range(n), 9]


def test_trials_of_something_else_are_not_put_into_a_file(tmp_path: Path) -> None:
    path = tmp_path / "one.jsonl"
    write_observations(path, HEAD, [trial(0)])
    before = path.read_bytes()
    with pytest.raises(
        RecordError, match=r"target 'twin:worn.toml' and not 'sim'; observe 'track' and not 'cells'"
    ):
        ObservationsFile(path, replace(HEAD, target="sim", observe="cells"))
    assert path.read_bytes() == before


KNOWN = replace(HEAD, identity="s2, Fluke 2, BoxOnWheels")


def test_a_target_that_is_known_may_have_another_name_and_not_another_identity(tmp_path: Path) -> None:
    """An emulator started again, on another port, was taken for something else."""
    path = tmp_path / "one.jsonl"
    write_observations(path, KNOWN, [trial(0)])
    with ObservationsFile(path, replace(KNOWN, target="scribbler:socket://127.0.0.1:7002")) as file:
        assert len(file.trials) == 1
    with pytest.raises(RecordError, match="identity 's2, Fluke 2, BoxOnWheels' and not 's1, Fluke 1'"):
        ObservationsFile(path, replace(KNOWN, identity="s1, Fluke 1"))


def test_names_distinguish_targets_if_an_identity_is_unknown(tmp_path: Path) -> None:
    path = tmp_path / "one.jsonl"
    write_observations(path, HEAD, [trial(0)])
    path.write_bytes(path.read_bytes().replace(b',"identity":""', b""))  # as files were before
    assert read_observations(path).head.identity == ""
    with ObservationsFile(path, KNOWN) as file:
        assert len(file.trials) == 1
    with pytest.raises(RecordError, match=r"target 'twin:worn.toml' and not 'sim'"):
        ObservationsFile(path, replace(KNOWN, target="sim"))


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
    if text:
        with pytest.raises(RecordError, match=said):
            ObservationsFile(path, HEAD)
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
    with pytest.raises(RecordError, match="Could not write"):
        ObservationsFile(tmp_path / "no folder" / "one.jsonl", HEAD)


def test_a_file_without_a_trial_is_nobodys(tmp_path: Path) -> None:
    """A command that was refused after its file was begun kept the right one from using the same name."""
    path = tmp_path / "trials.jsonl"
    ObservationsFile(path, HEAD).close()
    with ObservationsFile(path, replace(HEAD, observe="cells")) as file:
        file.append(trial(0))
    assert read_observations(path).head.observe == "cells"
    with pytest.raises(RecordError, match="observe 'cells' and not 'track'"):
        ObservationsFile(path, HEAD)
