"""Campaigns count what they injected and resume; small ones run here, those of a release with `--long`."""

import json
import random
import sys
from concurrent.futures import ProcessPoolExecutor

import pytest

from tests.forks import fork_context

from . import campaign
from .campaign import KINDS, Kind, read_lines, run_campaign, strike
from .forked import run_forked
from .mutations import mutated

pytestmark = pytest.mark.slow


@pytest.fixture
def fake(monkeypatch):
    """A kind of which every third fault fails, and that runs in this process."""
    monkeypatch.setattr(campaign, "KINDS", {"fake": Kind("fake", 10, 4)})
    monkeypatch.setattr(campaign, "strike_apart", strike)

    class Fake:
        @staticmethod
        def inject(seed, n, folder):
            assert folder.is_dir()
            for number in range(n):
                yield "" if number % 3 else f"number {number} of seed {seed} did not hold"

    monkeypatch.setitem(sys.modules, "tests.faults.fake", Fake)


@pytest.mark.usefixtures("fake")
def test_campaign_writes_a_line_per_batch_and_counts_failures(tmp_path, capsys):
    assert run_campaign("fake", out=tmp_path / "faults.jsonl") == 5
    lines = read_lines(tmp_path / "faults.jsonl")
    assert [(line["seed"], line["n"], line["failures"]) for line in lines] == [
        (0, 4, 2),
        (1, 4, 2),
        (2, 2, 1),
    ]
    assert lines[1]["examples"] == ["number 0 of seed 1 did not hold", "number 3 of seed 1 did not hold"]
    assert {"seconds", "date", "version", "machine", "python"} < set(lines[0])
    assert "10 of 10 faults, 5 failures" in capsys.readouterr().out


@pytest.mark.usefixtures("fake")
def test_campaign_resumes_by_its_file(tmp_path):
    file = tmp_path / "faults.jsonl"
    file.write_text(json.dumps({"kind": "fake", "n": 8, "failures": 0}) + "\n")
    run_campaign("fake", out=file)
    assert [(line["n"], line.get("seed")) for line in read_lines(file)] == [(8, None), (2, 1)]
    run_campaign("fake", out=file)
    assert len(read_lines(file)) == 2


def test_forked_work_reports_its_text_its_exception_and_its_kill(tmp_path):
    import time

    report = tmp_path / "report"
    assert run_forked(lambda: "made", report) == "done"
    assert report.read_text() == "made"
    assert run_forked(lambda: 1 / 0, report) == "failed"
    assert "ZeroDivisionError" in report.read_text()
    assert run_forked(lambda: time.sleep(60), report, kill_after=0.05) == "killed"


def test_mutations_are_equal_for_equal_seeds_and_change_the_file():
    data = b'[study]\nname = "a"\nseed = 12\n' * 5
    first, again = (
        [mutated(data, draw) for _ in range(200)] for draw in (random.Random(1), random.Random(1))
    )
    assert first == again
    assert sum(each != data for each in first) > 150


DRIVING = ("physical-kills", "gap-kills", "calibrate-kills", "transfer-kills", "try-kills")


@pytest.mark.parametrize(("kind", "n"), [("wire", 40), *((kind, 2) for kind in DRIVING)])
def test_few_faults_of_kinds_that_are_cheap_break_no_promise(kind, n):
    with ProcessPoolExecutor(1, mp_context=fork_context()) as pool:  # without the threads of this process
        assert not [problem for problem in pool.submit(strike, kind, 0, n).result() if problem]


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_faults_of_a_whole_campaign_break_no_promise(kind, tmp_path):
    assert run_campaign(kind, out=tmp_path / "faults.jsonl") == 0
