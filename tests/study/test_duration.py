"""The estimate of a study's computing time, from runs of it that are timed."""

from __future__ import annotations

import pytest

from realitygap._process import usable_processors
from realitygap.study import _duration, estimate_seconds, load_study, parse_study

SECONDS = {"coverage-10": 1.0, "novelty-10": 3.0}
"""Time of a run on one core, by condition [s]."""
POWERS = [2**k for k in range(12)]
STUDY = """
[study]
name = "timed"
replicates = 500
[[condition]]
name = "coverage-10"
noise = 0.1
[[condition]]
name = "novelty-10"
noise = 0.1
selection = "novelty"
"""


@pytest.fixture
def clock(monkeypatch):
    """Let the time of a call follow from the number of runs: a start of 0.05 s, then `SECONDS` / 1000 for each."""

    def seconds(condition, n_runs, pool, cores):
        return 0.05 + n_runs * SECONDS[condition.name] / 1000

    monkeypatch.setattr(_duration, "_seconds", seconds)


def test_estimate_is_the_mean_time_of_a_run_times_the_runs(clock):
    measured = {
        name: next(n for n in POWERS if 0.05 + n * each / 1000 >= 0.1) for name, each in SECONDS.items()
    }
    per_run = [(0.05 + n * SECONDS[name] / 1000) / n for name, n in measured.items()]
    expected = sum(per_run) / 2 * 1000 / usable_processors()
    assert estimate_seconds(parse_study(STUDY, "timed.toml")) == pytest.approx(expected)


def test_no_more_runs_are_timed_than_the_study_has(monkeypatch):
    asked = []
    monkeypatch.setattr(
        _duration, "_seconds", lambda condition, n, pool, cores: asked.append(n * cores) or 1e-6
    )
    estimate_seconds(parse_study(STUDY.replace("500", "5"), "timed.toml"))
    assert max(asked) < 2 * max(5, usable_processors())


def test_study_that_only_a_robot_drives_has_no_computing_time():
    assert estimate_seconds(load_study("paper-robot")) is None


def test_no_run_is_timed_where_each_takes_long_or_another_program_would_start(monkeypatch):
    monkeypatch.setattr(_duration, "prepare_kernels", lambda _: pytest.fail("a run was started"))
    study = STUDY + 'platform = "enki"\n[controller]\ninputs = ["range.0", "range.1", "bias"]\n'
    assert estimate_seconds(parse_study(study.replace("noise = 0.1\n", ""), "timed.toml")) is None


def test_estimate_of_real_runs_is_a_time():
    assert 0.0 < estimate_seconds(parse_study(STUDY, "timed.toml")) < 600.0
