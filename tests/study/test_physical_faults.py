"""A physical study whose ledger is locked, torn, or of another version, or whose link breaks in mid-trial."""

from __future__ import annotations

import contextlib
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from realitygap.emulator import Server, serve_tcp
from realitygap.errors import LedgerError, RealityGapError, RecordVersionError
from realitygap.families.scribbler.emulator import Emulator
from realitygap.records import LEDGER_NAME, Ledger
from realitygap.study import drive_study
from tests.byte_proxy import DIRECTIONS, KINDS, ByteProxy
from tests.trials.fake_robot import FakeRobot

from .physical import Unattended, drive, scored, small_study

pytestmark = pytest.mark.slow

LOCK = """
import sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute("BEGIN IMMEDIATE")
print("locked", flush=True)
sys.stdin.read()
"""


@contextlib.contextmanager
def locked(path: Path) -> Iterator[None]:
    """Have another process write to a ledger all the time."""
    with subprocess.Popen(
        [sys.executable, "-S", "-c", LOCK, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout.readline() == b"locked\n"
        yield
        process.stdin.close()


def begun(path: Path) -> FakeRobot:
    """Begin a study whose second trial is cut off; return its robot."""
    robot = FakeRobot(fault=_interrupt_at_step(6))
    with pytest.raises(KeyboardInterrupt):
        drive(small_study(), path, robot=robot)
    return robot


def _interrupt_at_step(n: int):
    left = n

    def point(what: str) -> None:
        nonlocal left
        left -= what == "drive"
        if left == 0:
            left = -1
            raise KeyboardInterrupt

    return point


def test_ledger_locked_by_another_process_is_one_message_and_the_study_resumes(tmp_path, monkeypatch):
    begun(tmp_path / "r")
    monkeypatch.setattr("realitygap.records._ledger_file._PATIENCE_S", 0.1)
    robot = FakeRobot()
    with locked(tmp_path / "r" / LEDGER_NAME):
        with pytest.raises(LedgerError, match=r"is in use: another program.*Wait until it ends") as caught:
            drive(small_study(), tmp_path / "r", robot=robot)
        assert caught.value.__context__ is None or "locked" in str(caught.value.__cause__)
    assert robot.motors == (0.0, 0.0)
    drive(small_study(), tmp_path / "r")
    drive(small_study(), tmp_path / "whole")
    assert scored(tmp_path / "r") == scored(tmp_path / "whole")


class LockingAfterTrial(Unattended):
    """Has another process lock the ledger when the first trial was driven."""

    def __init__(self, path: Path, stack: contextlib.ExitStack) -> None:
        super().__init__()
        self._path, self._stack = path, stack

    def drawn(self, card, driven):
        self._stack.enter_context(locked(self._path))
        return super().drawn(card, driven)


def test_ledger_locked_as_a_trial_ends_stops_the_study_and_the_trial_is_asked_about(tmp_path, monkeypatch):
    monkeypatch.setattr("realitygap.records._ledger_file._PATIENCE_S", 0.1)
    robot, path = FakeRobot(), tmp_path / "r"
    with contextlib.ExitStack() as stack:
        with pytest.raises(LedgerError, match="is in use: another program"):
            drive(small_study(), path, operator=LockingAfterTrial(path / LEDGER_NAME, stack), robot=robot)
        assert robot.motors == (0.0, 0.0)
        assert not robot.is_open
    with Ledger.open(path / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["running", "planned", "planned"]
    drive(small_study(), path)
    drive(small_study(), tmp_path / "whole")
    assert scored(path) == scored(tmp_path / "whole")


def _of_version_3(data: bytes) -> bytes:
    return data[:60] + (3).to_bytes(4, "big") + data[64:]  # SQLite's user version


@pytest.mark.parametrize(
    ("change", "kind", "said"),
    [
        (_of_version_3, RecordVersionError, "format 3; this realitygap reads formats 1 and 2"),
        (lambda data: data[: len(data) // 2], LedgerError, "is damaged"),
        (
            lambda data: data[:8192] + random.Random(1).randbytes(4096) + data[12288:],
            LedgerError,
            "is damaged",
        ),
        (lambda data: random.Random(1).randbytes(9000), LedgerError, "is damaged"),
    ],
)
def test_ledger_that_cannot_be_trusted_is_one_message_and_left_as_it_was(tmp_path, change, kind, said):
    begun(tmp_path / "r")
    path = tmp_path / "r" / LEDGER_NAME
    changed = change(path.read_bytes())
    path.write_bytes(changed)
    moved: list[str] = []
    with pytest.raises(kind, match=said) as caught:
        drive(small_study(), tmp_path / "r", robot=FakeRobot(fault=moved.append))
    assert str(path) in str(caught.value)
    assert path.read_bytes() == changed
    assert not moved, "no robot is driven for it"


# a broken link

STEPS = 5


class Disturbed(Unattended):
    """Disturbs the link at each step: one byte in some way, or all of it."""

    def __init__(self, proxy: ByteProxy, server: Server, seed: int, kinds: tuple[str, ...]) -> None:
        super().__init__(server.witness)
        self._proxy, self._random, self._kinds = proxy, random.Random(seed), kinds

    def watch(self, card, step, seen, command):
        kind = self._random.choice(self._kinds)
        if kind == "cut":
            self._proxy.cut()
        elif kind != "none":
            self._proxy.strike(kind, self._random.choice(DIRECTIONS))
        return super().watch(card, step, seen, command)


def disturb(
    path: Path,
    seed: int,
    kinds: tuple[str, ...],
    setup: tuple[str, str] = ("s2", "1"),
    n_generations: int = 1,
) -> None:
    """Drive a study over a disturbed link until it is complete.

    Whatever happens, only our errors end a sitting, the motors stand afterwards, and only trials with all of their
    steps are scored.
    """
    study = small_study(
        "coverage", population="2", generations=str(n_generations), steps=f"{STEPS}\nwait_s = 0.1"
    )
    n_struck = 0
    for sitting in range(30):
        with (
            serve_tcp(Emulator(*setup), speed=20.0) as server,
            ByteProxy(server.name, seed=seed) as proxy,
        ):
            operator = Disturbed(proxy, server, seed * 100 + sitting, kinds)
            result = None
            with contextlib.suppress(RealityGapError):
                result = drive_study(study, proxy.name, path, operator=operator)
            until = time.monotonic() + 5.0
            while server.witness.motors() != (0.0, 0.0):
                assert time.monotonic() < until, "The motors are running after the sitting."
                time.sleep(0.01)
            n_struck += proxy.n_struck.total()
        with Ledger.open(path / LEDGER_NAME) as ledger:
            for trial in ledger.trials(states=["scored"]):
                assert len(ledger.record(trial.trial).commands) == STEPS
        if result is not None and result.physical.n_complete == 1:
            return n_struck
    raise AssertionError("The study came to no end.")


def test_study_over_a_disturbed_link_completes_and_counts_only_whole_trials(tmp_path):
    assert disturb(tmp_path / "r", 19, (*KINDS, "cut", *("none",) * 5)) >= 3


@pytest.mark.long
@pytest.mark.parametrize("setup", [("s1", "none"), ("s1", "1"), ("s2", "none"), ("s2", "1"), ("s2", "2")])
def test_studies_survive_disturbed_links_of_all_robots(tmp_path, setup):
    for seed in range(4):
        disturb(tmp_path / f"r{seed}", seed, (*KINDS, "cut", *("none",) * 10), setup, n_generations=2)
