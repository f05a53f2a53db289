"""A robot on a port as a target."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realitygap.emulator import serve_tcp
from realitygap.errors import RecordError, RobotError, StudyError
from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.families.scribbler import ScribblerPlatform
from realitygap.families.scribbler.emulator import Emulator
from realitygap.records import TrialRecord, read_observations, trial_to_dict
from realitygap.robots import Command
from realitygap.robots.twin import sample_twin
from realitygap.study import (
    open_target,
    try_on,
)
from realitygap.study._physical import connect_robot
from realitygap.trials import OnLost, Pulse, RobotTarget, TrialPlan, WitnessObserver
from realitygap.trials._target_robot import PacedRobot
from realitygap.world import Pose, load_arena, paper_arena

from .fake_robot import FakeRobot

ARENA = paper_arena()
PORT = "emulator://s2?fluke=2&speed=off"
FORWARD = TrialPlan(commands=np.array([[1.0, 0.0]] * 4 + [[0.0, 0.5]] * 2), purpose="path", number=5)


def identity_of(url: str) -> str:
    """What is behind a port of an emulator in this program, as a target tells it."""
    with open_target(f"scribbler:{url}", ARENA) as target:
        return target.identity


def controller(steps: int = 8) -> TrialPlan:
    settings = NeatSettings.named("rosenzweig-remy", population=8, add_node=0.5, weight_step=5.0)
    genome: Genome = Population(3, 2, settings, seed=11, bias=False).ask()[2]
    return TrialPlan(start=Pose(0.5, 0.3, 1.0), genome=genome, steps=steps, number=7)


def emulated() -> RobotTarget:
    target = open_target(f"scribbler:{PORT}", ARENA)
    assert isinstance(target, RobotTarget)
    return target


@contextmanager
def emulator(*options: str) -> Iterator[tuple[str, str]]:
    """An emulator in another process that goes as fast as it can; its port and its witness's address."""
    command = [sys.executable, "-m", "realitygap", "emulate", "scribbler", "--tcp", "0", "--witness", "0"]
    speed = () if "--speed" in options else ("--speed", "0")
    with subprocess.Popen([*command, *speed, *options], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            port = process.stdout.readline().strip()
            yield f"scribbler:{port}", process.stdout.readline().split()[1]
        finally:
            process.terminate()


def test_driven_ahead_wheels_cells_and_poses_agree() -> None:
    with emulated() as target:
        (trial,) = target.carry_out([FORWARD], "track")
        assert (target.label, target.observes, target.n_sensors) == ("EMULATED", "track", 3)
    assert trial.end == "step limit"
    assert trial.step_s == 0.5
    assert trial.number == 5
    assert trial.purpose == "path"
    assert 8 < trial.battery_v < 10
    ahead = trial.poses[4, 0] - trial.poses[0, 0]
    assert trial.poses[0] == pytest.approx(tuple(ARENA.start))
    assert 0.2 < ahead < 0.35
    assert trial.wheels[4] == pytest.approx((ahead, ahead), abs=0.002)  # the encoders' counts are 0.25 mm
    assert trial.poses[6, 2] > 0.5  # to the left
    assert trial.wheels[6, 1] > trial.wheels[4, 1] > trial.wheels[6, 0]
    assert trial.cells == (13, 14, 15, 16, 17)


def test_a_command_lasts_its_time_whatever_the_readings_take() -> None:
    with emulated() as target:
        one, other = (target.carry_out([FORWARD], observe)[0] for observe in ("cells", "track"))
    assert one.step_s == other.step_s == 0.5
    slow = open_target(f"scribbler:{PORT}", ARENA, step_s=0.1)
    with slow:
        (trial,) = slow.carry_out([FORWARD], "cells")
    assert trial.step_s > 0.11  # what readings take by the wire


@pytest.mark.parametrize("observe", ["cells", "encoders"])
def test_a_trial_of_a_robot_has_no_more_than_is_to_be_observed(observe: Any) -> None:
    with emulated() as target:
        (trial,) = target.carry_out([FORWARD], observe)
    assert trial.observe == observe
    assert list(trial.cells) == sorted(trial.cells)


@pytest.mark.slow
def test_over_tcp_it_is_what_it_is_in_this_process() -> None:
    plans = [FORWARD, controller()]
    with emulated() as target:
        expected = target.carry_out(plans, "track")
    with emulator() as (port, witness), open_target(port, ARENA, witness=witness) as target:
        trials = target.carry_out(plans, "track")
    for trial, other in zip(trials, expected, strict=True):
        assert trial.cells == other.cells
        np.testing.assert_allclose(trial.poses, other.poses, atol=1e-3)
        np.testing.assert_allclose(trial.wheels, other.wheels, atol=1e-3)
        np.testing.assert_allclose(trial.readings, other.readings, atol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "is_the_same"),
    [("seed=3", True), ("id=b", True), ("speed=5", True), ("faults=sag=0.1", False), ("timing=off", False)],
)
def test_an_emulator_is_known_by_what_it_is_whatever_it_is_called(options: str, is_the_same: bool) -> None:
    one, other = identity_of(PORT), identity_of(f"emulator://s2?fluke=2&{options}")
    assert one.startswith("s2, Fluke 2")
    assert (one == other) is is_the_same


@pytest.mark.slow
def test_twins_behind_the_emulator_are_known_apart(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="twins need the extra 'twin'")
    known = []
    for name, seed in (("one", 1), ("same", 1), ("other", 2)):
        file = tmp_path / f"{name}.toml"
        file.write_text(sample_twin("close", seed).to_toml())
        known.append(identity_of(f"{PORT}&twin={file}"))
    assert known[0] == known[1] != known[2]
    assert len({*known, identity_of(PORT)}) == 3


def test_kept_trials_go_on_with_the_emulator_started_again_and_not_with_another(tmp_path: Path) -> None:
    """Its port is another one, and that made them trials of something else."""
    genome = controller().genome
    assert genome is not None
    kept = tmp_path / "kept.sqlite"
    for fluke, n in (("2", 1), ("2", 2), ("1", 3)):
        with serve_tcp(Emulator("s2", fluke), speed=0, witness=0) as server:  # type: ignore[arg-type]
            spec = f"scribbler:{server.name}"
            with open_target(spec, ARENA, witness=server.witness_address) as target:
                if fluke == "1":
                    with pytest.raises(
                        RecordError, match="identity 's2, Fluke 2, BoxOnWheels' and not 's2, Fl"
                    ):
                        try_on(target, genome, trials=n, steps=3, out=kept)
                else:
                    assert len(try_on(target, genome, trials=n, steps=3, out=kept)) == n
    assert len(read_observations(kept).trials) == 2


@pytest.mark.long
def test_a_twin_behind_the_emulator_drives_by_itself(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="twins need the extra 'twin'")
    file = tmp_path / "close.toml"
    file.write_text(sample_twin("close", 1).to_toml())
    with (
        emulator("--twin", str(file)) as (port, witness),
        open_target(port, ARENA, witness=witness) as target,
    ):
        trials = target.carry_out([FORWARD, controller()], "track")
    assert [trial.end for trial in trials] == ["step limit"] * 2
    ahead = trials[0].poses[4, 0] - trials[0].poses[0, 0]
    assert 0.1 < ahead < 0.4
    assert trials[0].wheels[4] == pytest.approx((ahead, ahead), rel=0.2)


class Failing:
    """A Scribbler whose link is lost at some commands, counted over all that were opened."""

    def __init__(self, robot: Any, lost_at: list[int]) -> None:
        self._robot, self._lost_at = robot, lost_at

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)

    def drive(self, command: Command) -> None:
        self._lost_at[0] -= 1
        if self._lost_at[0] == 0:
            self._lost_at.pop(0)
            raise RobotError("The link is gone.")
        self._robot.drive(command)


def failing(lost_at: list[int], on_lost: OnLost, pulse: Pulse | None = None) -> tuple[RobotTarget, list[Any]]:
    opened: list[Any] = []

    def open_robot() -> Any:
        opened.append(Failing(connect_robot(PORT)(ScribblerPlatform(reading_max=6400)), lost_at))
        return opened[-1]

    target = RobotTarget(
        open_robot, ARENA, WitnessObserver(), name="scribbler:test", on_lost=on_lost, pulse=pulse
    )
    return target, opened


def test_a_lost_trial_is_told_and_driven_again_once() -> None:
    target, opened = failing([3, 99], "retry")
    told: list[tuple[int, TrialRecord]] = []
    with target:
        (trial,) = target.carry_out([FORWARD], "track", lambda k, trial: told.append((k, trial)))
    assert [(k, each.end, len(each.commands)) for k, each in told] == [
        *[(0, "running", 0), (0, "lost", 2)],
        *[(0, "running", 0), (0, "step limit", 6)],
    ]
    assert len(told[1][1].poses) == 3
    assert trial_to_dict(trial) == trial_to_dict(told[3][1])
    assert len(opened) == 2
    assert all(robot.link.motors_off for robot in opened)


def test_pulse_has_each_answer_of_the_robot_and_no_end_of_a_lost_trial() -> None:
    pulses: list[bool] = []
    target, _ = failing([3, 99], "retry", pulses.append)
    with target:
        target.carry_out([FORWARD], "cells")
        n_lost = 1 + 5  # the beginning, and answers to three readings and two commands
        n_whole = 1 + 12
        assert pulses == [True] * (n_lost + n_whole) + [False]
        target.carry_out([FORWARD], "cells")
        assert pulses.count(False) == 2


def test_a_trial_lost_twice_stops_with_the_trials_before_it_kept() -> None:
    target, _ = failing([9, 2, 99], "retry")
    told: list[str] = []
    with (
        target,
        pytest.raises(RobotError, match=r"Trial 5 on scribbler:test was lost twice after 1 commands"),
    ):
        target.carry_out([FORWARD] * 2, "cells", lambda k, trial: told.append(trial.end))
    assert told == ["running", "step limit", "running", "lost", "running", "lost"]


def test_lost_trials_may_be_skipped() -> None:
    target, _ = failing([3, 99], "skip")
    with target:
        trials = target.carry_out([FORWARD] * 2, "track")
    assert [trial.end for trial in trials] == ["lost", "step limit"]


def test_ctrl_c_stops_the_motors_and_tells_the_trial_up_to_there() -> None:
    target = emulated()
    told: list[TrialRecord] = []

    class Impatient(Failing):
        def drive(self, command: Command) -> None:
            self._lost_at[0] -= 1
            if not self._lost_at[0]:
                raise KeyboardInterrupt
            self._robot.drive(command)

    robot = Impatient(connect_robot(PORT)(ScribblerPlatform(reading_max=6400)), [4])
    target = RobotTarget(lambda: robot, ARENA, WitnessObserver(), name="scribbler:test")
    with pytest.raises(KeyboardInterrupt):
        target.carry_out([FORWARD], "cells", lambda k, trial: told.append(trial))
    assert [(trial.end, len(trial.commands)) for trial in told] == [("running", 0), ("interrupted", 3)]
    assert robot.link.motors_off
    assert not robot.link.is_open


@pytest.mark.parametrize("asks", [False, True])
def test_ctrl_c_while_an_observer_is_asked_for_cells_tells_the_trial(asks: bool) -> None:
    class Asked(WitnessObserver):
        def cells(self) -> tuple[int, ...]:
            raise KeyboardInterrupt

    robot = connect_robot(PORT)(ScribblerPlatform(reading_max=6400))
    observer = Asked()
    observer.asks = asks
    target = RobotTarget(lambda: robot, ARENA, observer, name="scribbler:test")
    told: list[TrialRecord] = []
    with pytest.raises(KeyboardInterrupt):
        target.carry_out([FORWARD], "cells", lambda k, trial: told.append(trial))
    ends = [("driven", 6), ("driven", 6)] if asks else [("interrupted", 6)]
    assert [(trial.end, len(trial.commands)) for trial in told] == [("running", 0), *ends]


def test_wrong_targets_are_refused_before_a_robot_moves() -> None:
    with pytest.raises(StudyError, match="No operator places the robot of scribbler:/dev/rfcomm0"):
        open_target("scribbler:/dev/rfcomm0", ARENA)
    with pytest.raises(StudyError, match=r"'scribler:x' is no platform. Did you mean 'scribbler:PORT'"):
        open_target("scribler:x", ARENA)
    with pytest.raises(StudyError, match=r"no-such-robot"):
        open_target("sim:no-such-robot", ARENA)
    with pytest.raises(RobotError, match="No witness at 127"):
        open_target("scribbler:socket://127.0.0.1:1", ARENA, witness="127.0.0.1:1")
    with pytest.raises(RobotError, match="drives in the arena 'paper', and the study is about"):
        open_target(f"scribbler:{PORT}", load_arena("wall"))


class Stuttering:
    """A clock whose robot takes a second and a half for one of its commands, as where a byte was lost."""

    def __init__(self, late_at: int) -> None:
        self._now, self._asked, self._late_at = 0.0, 0, late_at

    def now(self) -> float:
        self._asked += 1
        self._now += 1.5 if self._asked == self._late_at else 0.0
        return self._now

    def sleep(self, seconds: float) -> None:
        self._now += seconds


@pytest.mark.parametrize(("late_at", "n"), [(7, 10), (3, 100)])
def test_one_late_command_does_not_make_all_of_them_longer(late_at: int, n: int) -> None:
    robot = PacedRobot(FakeRobot(), 0.5, Stuttering(late_at))
    robot.reset()
    for _ in range(n):
        robot.observe()
        robot.drive(Command(1.0, 0.0))
    assert robot.lasted_s == 0.5


@pytest.mark.slow
@pytest.mark.parametrize("speed", ["20", "1000"])
def test_commands_last_as_long_however_fast_the_emulator_is(speed: str) -> None:
    with emulated() as target:
        (expected,) = target.carry_out([FORWARD], "track")
    with (
        emulator("--speed", speed) as (port, witness),
        open_target(port, ARENA, witness=witness) as target,
    ):
        (trial,) = target.carry_out([FORWARD], "track")
    assert (trial.end, trial.step_s) == ("step limit", 0.5)
    np.testing.assert_allclose(trial.poses, expected.poses, atol=1e-3)


@pytest.mark.slow
def test_a_robot_that_was_left_driving_too_fast_for_the_machine_answers_all_the_same(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="twins need the extra 'twin'")
    file = tmp_path / "close.toml"
    file.write_text(sample_twin("close", 1).to_toml())
    with emulator("--twin", str(file), "--speed", "1000") as (port, witness):
        with socket.create_connection(("127.0.0.1", int(port.rpartition(":")[2]))) as left:
            left.sendall(bytes([109, 255, 100, 0, 0, 0, 0, 0, 0]))  # SET_MOTORS, to turn on the spot
            time.sleep(3.0)
        with open_target(port, ARENA, witness=witness) as target:
            (trial,) = target.carry_out([FORWARD], "track")
    assert (trial.end, trial.step_s) == ("step limit", 0.5)
