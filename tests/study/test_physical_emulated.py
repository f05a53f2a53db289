"""The physical conditions of a study over the wire: driver, bytes, emulator, ledger and NEAT, with no real time."""

from __future__ import annotations

import os
import random
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from realitygap.errors import RealityGapError
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder
from realitygap.report import summarize, write_report
from realitygap.study import drive_study, load_study, run_study
from realitygap.trials import TrialInterrupted

from .physical import Unattended, scored, small_study
from .test_killed import no_waiting_for_the_disk  # noqa: F401 - a fixture

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PORT = "emulator://s2?fluke=1&speed=off"
LONGER = {"steps": "12"}


def trials_of(path: Path) -> list:
    with Ledger.open(path / LEDGER_NAME, writable=False) as ledger:
        return ledger.trials()


@pytest.mark.parametrize("selection", ["coverage", "novelty"])
def test_a_study_runs_unattended_and_comes_out_the_same_again(tmp_path, selection):
    study = small_study(selection, **LONGER)
    for name in ("a", "b"):
        result = drive_study(study, PORT, tmp_path / name)
        assert result.physical is not None
        assert (result.physical.n_complete, result.physical.n_driven) == (1, 6)
    assert scored(tmp_path / "a") == scored(tmp_path / "b")
    folder = ResultsFolder.open(tmp_path / "a")
    assert folder.digest() == ResultsFolder.open(tmp_path / "b").digest()
    frame = folder.read()
    assert (frame["coverage_ends"] <= frame["coverage_line"]).all()
    assert frame["coverage_line"].max() > 2 / 72, "some robot moved"
    with Ledger.open(tmp_path / "a" / LEDGER_NAME) as ledger:
        assert ledger.conditions()["robot"]["label"] == "EMULATED"
        (sitting,) = ledger.sittings()
        assert sitting["robot"]["model"] == "s2"
        assert sitting["ended"] is not None
        times = ledger.record(1).times
        assert len(times) == 12
        assert np.all(np.abs(np.diff(times) - 0.5) < 0.3)
        assert len(ledger.scores()[0]["path"]) == 4 * 12 + 1


OTHER_ARENA = """
walls = [[0, 0, 2, 0], [2, 0, 2, 1], [2, 1, 0, 1], [0, 1, 0, 0]]
start = [0.5, 0.5, 0.0]
[grid]
x = 0.0
y = 0.0
cell = 0.1
columns = 20
rows = 10
"""


def test_a_robot_in_another_arena_than_the_study_s_is_refused(tmp_path):
    # its cells would have been counted in another grid
    file = tmp_path / "other.toml"
    file.write_text(OTHER_ARENA)
    study = small_study("coverage", **LONGER)
    with pytest.raises(RealityGapError, match=r"drives in the arena 'other', and the study is about 'paper'"):
        drive_study(study, f"{PORT}&arena={file}", tmp_path / "out")
    assert {trial.state for trial in trials_of(tmp_path / "out")} == {"planned"}
    assert drive_study(study, PORT, tmp_path / "out").physical.n_complete == 1


def killed_after(n_trials: int, path: Path, study) -> bool:
    """Carry out the study in a process that is killed in the middle of a trial; whether it was."""
    child = os.fork()
    if child == 0:
        try:
            drive_study(study, PORT, path, operator=KilledAfter(n_trials))
        except BaseException:
            os._exit(1)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return os.WTERMSIG(status) == signal.SIGKILL
    assert os.waitstatus_to_exitcode(status) == 0
    return False


class KilledAfter(Unattended):
    """Ends its process without warning at a step."""

    def __init__(self, n_steps: int) -> None:
        super().__init__()
        self._left = n_steps

    def watch(self, card, step, seen, command):
        if self._left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        self._left -= 1
        return super().watch(card, step, seen, command)


@pytest.mark.skipif(sys.platform == "win32", reason="kills processes")
def test_a_study_killed_at_each_step_goes_on_as_if_nothing_had_happened(tmp_path):
    study = small_study("novelty", steps="3")
    drive_study(study, PORT, tmp_path / "whole")
    wanted = scored(tmp_path / "whole")
    n_steps = 6 * 3
    for step in range(n_steps):
        path = tmp_path / f"killed-{step}"
        assert killed_after(step, path, study)
        states = [trial.state for trial in trials_of(path)]
        assert states.count("running") == 1
        assert states.count("scored") == step // 3
        assert not killed_after(10**9, path, study)
        assert scored(path) == wanted, step
        void = [trial for trial in trials_of(path) if trial.state == "void"]
        assert len(void) == 1, "the trial in flight alone was driven again"


def inject(n_faults: int, folder: Path) -> None:
    """Pull plugs and stop programs at random steps, over the wire to one emulated robot that outlives the programs."""
    rng = random.Random(n_faults)
    n_struck = 0
    n_studies = 0
    while n_struck < n_faults:
        path = folder / f"study-{n_studies}"
        port = f"{PORT}&id=faults-{os.getpid()}-{n_faults}-{n_studies}"
        n_studies += 1
        known: dict[int, tuple[int, ...] | None] = {}
        for _ in range(1000):
            operator = Faulty(rng)
            result = None
            try:
                result = drive_study(small_study("novelty", steps="3"), port, path, operator=operator)
            except (RealityGapError, TrialInterrupted, KeyboardInterrupt):
                assert operator.has_struck
            n_struck += operator.has_struck
            if operator.has_met and operator.kind != "hang-up":
                assert operator.witness.motors() == (0.0, 0.0), operator.kind
            if (path / LEDGER_NAME).exists():
                now = {trial.trial: trial.cells for trial in trials_of(path) if trial.state == "scored"}
                assert known.items() <= now.items()
                known = now
            if result is not None and result.physical.n_complete == 1:
                break
        else:
            raise AssertionError("The study came to no end.")
        assert operator.witness.motors() == (0.0, 0.0)


class Faulty(Unattended):
    """Does something to the program or the link at a random step."""

    def __init__(self, rng: random.Random) -> None:
        super().__init__()
        self.kind = rng.choice(("hang-up", "interrupt", "terminate", "noise", "abort"))
        self.has_struck = self.has_met = False
        self._left = rng.randrange(20)
        self._port = None

    def meet(self, robot):
        super().meet(robot)
        self._port = robot.port
        self.has_met = True

    def watch(self, card, step, seen, command):
        super().watch(card, step, seen, command)
        self._left -= 1
        if self._left >= 0 or self.has_struck:
            return False
        self.has_struck = True
        if self.kind == "interrupt":
            raise KeyboardInterrupt
        if self.kind == "terminate":
            raise SystemExit(143)
        if self.kind == "noise":
            self._port._buffer += bytes((7, 109, 0))  # bytes that nobody sent
        if self.kind == "hang-up":
            self._port.close()
        return self.kind == "abort"


def test_no_fault_on_the_wire_loses_a_scored_trial_or_leaves_the_motors_running(tmp_path):
    inject(20, tmp_path)


@pytest.mark.long
@pytest.mark.usefixtures("no_waiting_for_the_disk")
def test_studies_survive_two_thousand_faults_on_the_wire(tmp_path):
    inject(2_000, tmp_path)


def test_a_mixed_study_has_simulated_arms_beside_an_emulated_one(tmp_path):
    study = load_study(ROOT / "examples" / "robot-beside-simulation.toml", replicates=1)
    result = run_study(study, tmp_path / "mixed")
    assert (result.n_runs, result.physical.n_runs, result.physical.n_complete) == (2, 2, 0)
    result = drive_study(study, PORT, tmp_path / "mixed")
    assert (result.n_runs, result.physical.n_runs, result.physical.n_complete) == (0, 2, 2)
    labels = dict(summarize(result.folder).select("condition", "label").iter_rows())
    assert labels == {
        "coverage-10": "SIM",
        "novelty-10": "SIM",
        "coverage-robot": "EMULATED",
        "novelty-robot": "EMULATED",
    }
    page = write_report(result.folder).read_text()
    assert "EMULATED and SIM" in page


@pytest.mark.long
def test_the_papers_physical_study_runs_unattended(tmp_path):
    result = drive_study("paper-robot", PORT, tmp_path / "paper")
    assert (result.physical.n_complete, result.physical.n_driven) == (6, 240)
    summary = summarize(result.folder)
    assert summary["label"].to_list() == ["EMULATED", "EMULATED"]
    assert summary["line_median"].min() > 0.15
    assert 'id="figure-individuals-novelty"' in write_report(result.folder).read_text()


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_an_emulator_in_another_program_is_driven_and_witnessed(tmp_path):
    """The command line on a pseudo-terminal, 5 times as fast as real time."""
    (tmp_path / "small.toml").write_text(SMALL_FILE)
    command = [sys.executable, "-m", "realitygap"]
    emulator = subprocess.Popen(
        [*command, "emulate", "scribbler", "--fluke", "1", "--link", str(tmp_path / "port"), "--witness", "0",
         "--speed", "5"],
        stdout=subprocess.PIPE, text=True, cwd=ROOT,
    )  # fmt: skip
    try:
        witness = None
        for line in emulator.stdout:
            if found := re.search(r"(127\.0\.0\.1:\d+)", line):
                witness = found[1]
                break
        assert witness is not None
        out = tmp_path / "out"
        done = subprocess.run(
            [*command, "drive", str(tmp_path / "small.toml"), "--out", str(out), "--port", str(tmp_path / "port"),
             "--witness", witness],
            capture_output=True, text=True, cwd=ROOT, timeout=120, check=False,
        )  # fmt: skip
    finally:
        emulator.terminate()
        emulator.wait(20)
    assert done.returncode == 0, done.stderr
    assert "1 of 1 runs on a robot are complete" in done.stdout
    with Ledger.open(out / LEDGER_NAME) as ledger:
        assert ledger.conditions()["robot"]["label"] == "EMULATED"


SMALL_FILE = """
[study]
name = "small"
replicates = 1

[neat]
population = 2
generations = 1

[platform.scribbler]
steps = 4

[[condition]]
name = "robot"
platform = "scribbler"
"""
