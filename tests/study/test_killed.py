"""A physical study killed at each of its steps, and hit by faults, loses nothing that was scored."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import sqlite3
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from realitygap.errors import LedgerError, RealityGapError, RobotError
from realitygap.records import LEDGER_NAME, Ledger
from realitygap.trials import TrialInterrupted
from tests.trials.fake_robot import FakeRobot

from .physical import Unattended, drive, scored, small_study

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="kills processes")]

Point = Callable[[str], None]


class Telling(Unattended):
    """A witness that says when it is called, and writes down which trials it was asked to place."""

    def __init__(self, point: Point, diary: Path) -> None:
        super().__init__()
        self._point = point
        self._diary = diary

    def place(self, card):
        self._point("place")
        with self._diary.open("a") as file:
            trial = card.trial
            file.write(f"{trial.trial} {trial.generation} {trial.individual}\n")
            file.flush()
            os.fsync(file.fileno())
        super().place(card)
        self._point("placed")

    def drawn(self, card, driven):
        self._point("drawn")
        return super().drawn(card, driven)

    def settle(self, card, problem):
        self._point("settle")
        return super().settle(card, problem)

    def close(self, cards):
        self._point("close")
        return super().close(cards)


@contextlib.contextmanager
def before_and_after_commits(point: Point):
    """Call `point` on both sides of every commit of a ledger."""
    commit = Ledger._commit

    def telling(ledger: Ledger) -> None:
        point("before a commit")
        commit(ledger)
        point("after a commit")

    Ledger._commit = telling
    try:
        yield
    finally:
        Ledger._commit = commit


def carry_out(path: Path, point: Point, selection: str) -> None:
    study = small_study(selection, population="2", steps="2")
    with before_and_after_commits(point):
        drive(study, path, operator=Telling(point, path.with_suffix(".diary")), fault=point)


def count_points(path: Path, selection: str) -> int:
    count = 0

    def point(what: str) -> None:
        nonlocal count
        count += 1

    carry_out(path, point, selection)
    return count


def killed_at(number: int, path: Path, selection: str) -> bool:
    """Carry out the study in a process of its own that is killed at one of its points; whether it was."""
    child = os.fork()
    if child == 0:
        left = number

        def point(what: str) -> None:
            nonlocal left
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            left -= 1

        try:
            carry_out(path, point, selection)
        except BaseException:
            os._exit(1)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return os.WTERMSIG(status) == signal.SIGKILL
    assert os.waitstatus_to_exitcode(status) == 0
    return False


def placed(path: Path) -> list[tuple[int, int, int]]:
    """Trial, generation and individual of each placing, in order."""
    return [tuple(map(int, line.split())) for line in path.with_suffix(".diary").read_text().splitlines()]


def check_nothing_was_asked_twice(path: Path) -> None:
    """No trial is placed again after it was scored; an individual is only where its trial was cut off."""
    with Ledger.open(path / LEDGER_NAME) as ledger:
        states = {trial.trial: trial.state for trial in ledger.trials()}
    seen: dict[tuple[int, int], int] = {}
    for number, generation, individual in placed(path):
        before = seen.get((generation, individual))
        assert before is None or before == number or states[before] == "void"
        seen[generation, individual] = number


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.long)])
def test_a_study_killed_at_any_point_goes_on_as_if_nothing_had_happened(tmp_path, every):
    selection = "novelty"
    n_points = count_points(tmp_path / "whole", selection)
    wanted = scored(tmp_path / "whole")
    assert n_points > 80
    for number in range(0, n_points, every):
        path = tmp_path / f"killed-{number}"
        assert killed_at(number, path, selection), number
        assert not killed_at(10**9, path, selection), number
        assert scored(path) == wanted, number
        check_nothing_was_asked_twice(path)


def test_a_study_killed_again_and_again_comes_to_its_end(tmp_path):
    """Each sitting is killed a little later than the one before, so that all of them get somewhere."""
    path = tmp_path / "killed"
    rng = random.Random(1)
    sittings = 0
    while killed_at(rng.randrange(20, 45), path, "coverage"):
        sittings += 1
        assert sittings < 100
    assert sittings >= 3
    drive(small_study("coverage", population="2", steps="2"), tmp_path / "whole")
    assert scored(path) == scored(tmp_path / "whole")
    check_nothing_was_asked_twice(path)


@pytest.fixture
def no_waiting_for_the_disk(monkeypatch):
    """A program that ends leaves what it wrote to the system; waiting for the disk is for a loss of power."""
    monkeypatch.setattr("realitygap.records._ledger_file.SYNCHRONOUS", "OFF")


FAULTS = ("lost", "interrupted", "terminated", "disk full", "foreign error")


def fault(kind: str) -> BaseException:
    return {
        "lost": RobotError("No reply."),
        "interrupted": KeyboardInterrupt(),
        "terminated": SystemExit(143),
        "disk full": sqlite3.OperationalError("database or disk is full"),
        "foreign error": ZeroDivisionError("a fault of somebody's own"),
    }[kind]


def inject(n_faults: int, folder: Path) -> None:
    """Hit studies with faults at random points until so many have struck; check after each."""
    rng = random.Random(n_faults)
    n_struck = 0
    drive(small_study("novelty"), folder / "whole")
    wanted = scored(folder / "whole")
    n_studies = 0
    while n_struck < n_faults:
        path = folder / f"study-{n_studies}"
        n_studies += 1
        known: dict[int, tuple[int, ...] | None] = {}
        for _ in range(1000):
            robots: list[FakeRobot] = []
            left = rng.randrange(1, 90)
            kind = rng.choice(FAULTS)
            has_struck = False

            def point(what: str, kind: str = kind) -> None:
                nonlocal left, has_struck
                left -= 1
                at_commit = what.endswith("commit")
                if left <= 0 and not has_struck and (kind == "disk full") == at_commit and what != "stop":
                    has_struck = True
                    raise fault(kind)

            robot = FakeRobot(fault=point)
            robots.append(robot)
            try:
                with before_and_after_commits(point):
                    result = drive(
                        small_study("novelty"),
                        path,
                        operator=Telling(point, path.with_suffix(".diary")),
                        robot=robot,
                    )
            except (RealityGapError, TrialInterrupted, KeyboardInterrupt, SystemExit, ZeroDivisionError):
                result = None
            n_struck += has_struck
            assert robot.motors == (0.0, 0.0), (kind, left)
            if (path / LEDGER_NAME).exists():
                with Ledger.open(path / LEDGER_NAME) as ledger:
                    now = {trial.trial: trial.cells for trial in ledger.trials(states=["scored"])}
                assert known.items() <= now.items(), kind
                known = now
            if result is not None and not has_struck:
                break
        assert scored(path) == wanted
        check_nothing_was_asked_twice(path)


@pytest.mark.usefixtures("no_waiting_for_the_disk")
def test_no_fault_loses_a_scored_trial_or_leaves_the_motors_running(tmp_path):
    inject(100, tmp_path)


@pytest.mark.long
@pytest.mark.usefixtures("no_waiting_for_the_disk")
def test_ten_thousand_faults_lose_no_scored_trial_and_leave_no_motor_running(tmp_path):
    inject(10_000, tmp_path)


def test_a_full_disk_is_one_clear_error_and_what_was_scored_stays(tmp_path):
    """The limit on the size of files stands for the disk; the ledger's log of writes runs into it."""
    import resource

    path = tmp_path / "full"
    child = os.fork()
    if child == 0:
        text = ""
        try:
            drive(small_study(), path, operator=FullAfter(2, resource))
        except LedgerError as error:
            text = str(error)
        except BaseException as error:
            text = f"otherwise: {error!r}"
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        (tmp_path / "said").write_text(text)
        os._exit(0)
    os.waitpid(child, 0)
    said = (tmp_path / "said").read_text()
    assert said.startswith(f"Could not write {path / LEDGER_NAME}"), said
    assert "All that was written before is safe" in said
    assert "run the same command again" in said
    with Ledger.open(path / LEDGER_NAME) as ledger:
        assert len(ledger.trials(states=["scored"])) >= 1
    drive(small_study(), path)
    drive(small_study(), tmp_path / "whole")
    assert scored(path) == scored(tmp_path / "whole")


class FullAfter(Unattended):
    """Fills the disk when so many trials were placed."""

    def __init__(self, n_trials: int, resource) -> None:
        super().__init__()
        self._left = n_trials
        self._resource = resource

    def place(self, card):
        super().place(card)
        self._left -= 1
        if self._left == 0:
            self._resource.setrlimit(self._resource.RLIMIT_FSIZE, (1, self._resource.RLIM_INFINITY))
