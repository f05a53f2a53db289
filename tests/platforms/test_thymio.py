"""The platform `thymio` on Aseba's playground, eight times as fast as real time."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

import realitygap.gym  # noqa: F401  # registers the tasks
from realitygap.emulator import connect_witness
from realitygap.errors import RobotError, StudyError
from realitygap.families.thymio import Playground, Thymio, ThymioPlatform
from realitygap.families.thymio.playground import _playground
from realitygap.families.thymio.playground._playground import why_not
from realitygap.platforms import SimPlatform, open_target, platform_of
from realitygap.records import Ledger
from realitygap.robots import open_on
from realitygap.study import (
    calibrate,
    drive_study,
    load_study,
)
from realitygap.study._physical import connect_robot
from realitygap.trials import TrialPlan
from realitygap.world import Arena, Obstacle, Pose, paper_arena
from tests.commands import run_command

SPEED = 8.0
EMULATED = "thymio:emulator://playground?speed=8"
ARENA = paper_arena()
needs_playground = pytest.mark.skipif(bool(why_not(SPEED)), reason=why_not(SPEED) or "-")


def test_a_robot_on_a_port_needs_somebody_who_places_it():
    with pytest.raises(StudyError, match="No operator places the robot of thymio:/dev/no-such"):
        open_target("thymio:/dev/no-such", ARENA)
    assert platform_of("thymio:/dev/ttyACM0").needs_person
    assert not platform_of(EMULATED).needs_person
    with pytest.raises(StudyError, match="expected thymio:PORT"):
        platform_of("thymio")


def test_a_port_of_another_platform_is_refused():
    with pytest.raises(StudyError, match="a port of platform 'scribbler', expected one of 'thymio'"):
        connect_robot("scribbler:emulator://s2")(ThymioPlatform())


def test_settings_of_a_playground_that_cannot_be_have_one_message_each():
    for port, message in {
        "emulator://playground?sped=8": "unknown option 'sped'.*speed",
        "emulator://playground?speed=fast": "speed=fast, expected a number",
        "emulator://playground?speed=20": r"speed is 20, expected 0\.1 to 8",
        "emulator://playground?arena=no-such": "no-such",
        "emulator://playground?window=yes": "window=yes, expected on or off",
        "emulator://s2": "an emulated Thymio is emulator://playground",
    }.items():
        with pytest.raises(RobotError, match=message):
            ThymioPlatform(port=port).connect()


def test_an_arena_that_the_playground_cannot_have_is_refused():
    without = Arena("open", (), ARENA.grid, ARENA.start)
    with pytest.raises(RobotError, match="no walls around it"):
        Playground(without)


def test_missing_programs_are_named_with_their_packages(monkeypatch):
    monkeypatch.setattr(_playground.shutil, "which", lambda program, path: None)
    with pytest.raises(RobotError, match="apt-get install aseba dbus iproute2 util-linux"):
        Playground()


def test_the_papers_study_is_on_sim_and_on_a_thymio():
    study = load_study("paper-thymio")
    assert [condition.on.name for condition in study.conditions] == ["sim", "sim", "thymio", "thymio"]
    assert {condition.on.command_s for condition in study.conditions} == {0.5}


@pytest.mark.slow
@needs_playground
def test_trials_begin_where_they_should_and_are_seen_to_their_end():
    plans = [
        TrialPlan(Pose(0.4, 0.3, 0.5), commands=np.array([[1.0, 0.0]] * 12), number=1),
        TrialPlan(commands=np.array([[0.0, 1.0]] * 5), number=2, sees_end=True),
    ]
    with open_target(EMULATED, ARENA) as target:
        assert (target.label, target.n_sensors, target.observes) == ("EMULATED", 7, "track")
        assert target.identity.startswith("playground paper ")
        assert "line.0" in target.inputs
        assert "encoder.0" not in target.inputs
        ahead, turned = target.carry_out(plans, "track")
    assert ahead.poses[0] == pytest.approx((0.4, 0.3, 0.5), abs=1e-5)
    assert len(ahead.poses) == 13
    # 12 commands of 0.1 s at 9.9 cm/s; the playground acts in steps of 30 ms, and a busy machine is late
    assert math.dist(ahead.poses[-1][:2], ahead.poses[0][:2]) == pytest.approx(0.119, rel=0.35)
    assert turned.poses[0] == pytest.approx(tuple(ARENA.start), abs=1e-5)
    assert 0.3 < turned.poses[-1][2] < 2.5
    assert len(turned.last_readings) == 7
    assert not ahead.stalled.any()


@pytest.mark.slow
@needs_playground
def test_obstacles_stand_where_the_arena_has_them():
    """Readings are those of `sim`, which reads as Enki does, at poses near a wall, a box, a polygon and a disc."""
    boxes = (
        Obstacle(0.7, 0.2, 0.4, ((-0.05, -0.03), (0.05, -0.03), (0.05, 0.03), (-0.05, 0.03))),
        Obstacle(0.4, 0.45, radius=0.04),
    )
    walls = (*ARENA.walls, (0.9, 0.6096, 0.9, 0.4))
    arena = replace(ARENA, name="with boxes", obstacles=boxes, walls=walls)
    poses = [
        Pose(0.57, 0.17, 0.1),
        Pose(0.28, 0.44, 0.0),
        Pose(0.78, 0.5, 0.2),
        Pose(0.2, 0.12, -1.5),
        Pose(0.95, 0.3, -0.4),
    ]
    simulated = SimPlatform(robot="thymio", noise=False, precision="double").open_robot(arena)
    with Playground(arena, speed=SPEED) as playground, Thymio(playground.port) as robot:
        for pose in poses:
            playground.place(pose)
            robot.clock.sleep(0.2)
            simulated.reset(pose)
            seen, expected = robot.observe().readings, simulated.observe().readings
            assert max(expected) > 0.3
            # the playground keeps the last value of a ray that sees nothing any more
            assert sum(abs(a - b) > 0.03 for a, b in zip(seen, expected, strict=True)) <= 1, (
                pose,
                seen,
                expected,
            )


@pytest.mark.slow
@needs_playground
def test_a_gap_and_a_calibration_run_without_a_person():
    words = ("--n-controllers", "2", "--trials", "1", "--observe", "track")
    done = run_command("gap", "sim:thymio", EMULATED, *words)
    assert done.returncode == 0, done.stderr
    assert "EMULATED" in done.stdout
    with open_target(EMULATED, ARENA) as target:
        made = calibrate("path", target, robot="thymio", observe="track", budget=4)
    gain = next(each for each in made.fitted if each.name == "drive.gain")
    assert 0.8 < gain.estimate < 1.2
    assert made.label == "EMULATED"


@pytest.mark.slow
@needs_playground
def test_a_study_is_driven_on_it_and_kept_in_the_ledger(tmp_path):
    file = tmp_path / "small.toml"
    file.write_text(
        """
[study]
name = "small"
replicates = 1

[controller]
inputs = ["range.0", "range.2", "range.4", "line.0", "bias"]

[neat]
population = 2
generations = 1

[platform.thymio]
steps = 5

[[condition]]
name = "robot"
platform = "thymio"
"""
    )
    result = drive_study(file, EMULATED, tmp_path / "out")
    assert result.physical.n_complete == 1
    with Ledger.open(tmp_path / "out" / "ledger.sqlite", writable=False) as ledger:
        trials, record = ledger.trials("robot", 0, 0), ledger.record(1)
        assert [trial.state for trial in trials] == ["scored", "scored"]
        assert record.raw.shape == (5, 7)
        assert ledger.conditions()["robot"]["label"] == "EMULATED"
        (sitting,) = ledger.sittings()
        assert sitting["port"] == EMULATED


@pytest.mark.slow
@needs_playground
def test_emulate_serves_the_robot_and_its_witness_to_other_programs():
    words = ["-m", "realitygap", "emulate", "thymio", "--speed", "8", "--witness", "0", "--arena", "paper"]
    with subprocess.Popen(
        [sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as served:
        try:
            port = served.stdout.readline().strip()
            address = served.stdout.readline().split()[1]
            with connect_witness(address) as witness:
                witness.place(Pose(0.5, 0.3, 1.0), 0)
                assert witness.hold() is None
                _, robot = open_on(port)
                with robot:
                    assert robot.label == "EMULATED"
                assert witness.pose() == pytest.approx((0.5, 0.3, 1.0), abs=1e-6)
            with open_target(port, ARENA, witness=address) as target:
                (trial,) = target.carry_out([TrialPlan(commands=np.array([[1.0, 0.0]] * 3))], "track")
            assert trial.poses[-1][0] > trial.poses[0][0] + 0.01
        finally:
            served.send_signal(signal.SIGTERM)
            _, said = served.communicate(timeout=120)
    assert served.returncode == 0
    assert "no encoders and no stall" in said


@pytest.mark.slow
@needs_playground
def test_gymnasium_drives_it_step_by_step():
    env = gymnasium.make(
        "realitygap/ScribblerCoverage-v1",
        platform=EMULATED,
        controller={"inputs": ["range.2", "range.5", "line.1"]},
    )
    seen, _ = env.reset(seed=1)
    assert seen.shape == (3,)
    for _ in range(3):
        seen, _, is_over, _, _ = env.step(np.array([1.0, 0.0], np.float32))
        assert not is_over
    env.close()
    with pytest.raises(ValueError, match="cannot place a robot on the floor"):
        gymnasium.make("realitygap/ScribblerCoverage-v1", platform="thymio:/dev/ttyACM0")
