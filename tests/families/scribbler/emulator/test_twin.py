"""A twin behind the emulator, as real clients meet it."""

import math

import numpy as np
import pytest

from realitygap.errors import RobotError
from realitygap.families.scribbler import Scribbler
from realitygap.families.scribbler.emulator import Emulator, RobotOfItsOwn
from realitygap.robots import Command
from realitygap.robots.twin import TwinBody, TwinModel, TwinRobot, sample_twin
from realitygap.robots.twin._shape import STEP_S
from realitygap.world import Pose, paper_arena

from .wire import ask, packet, say, signed

pytestmark = pytest.mark.slow

pytest.importorskip("mujoco")

QUIET = {
    "motors": {"wander": 0.0, "delay": 0.0, "delay_jitter": 0.0, "lag": 0.0},
    "encoders": {"noise_per_m": 0.0, "count": 0.0},
    "ir": {"spread": 0.0, "noise": 0.0},
    "battery": {"volts": 8.0, "sag": 0.5, "fall_per_s": 0.0},
}


def quiet(**changes):
    values = {name: dict(table) for name, table in QUIET.items()}
    for name, table in changes.items():
        values[name] = values.get(name, {}) | table
    return TwinModel(**values)


def emulated(model, **options):
    arena = paper_arena()
    return Emulator("s2", "2", arena=arena, robot=TwinBody(model, arena), timing=False, **options)


def test_a_twins_body_is_a_robot_of_its_own():
    assert isinstance(TwinBody(quiet(), paper_arena()), RobotOfItsOwn)
    with pytest.raises(ValueError, match="cannot stand behind the emulator"):
        TwinBody(sample_twin("same", 1), paper_arena())


def test_it_drives_where_the_twin_alone_would():
    robot = emulated(quiet())
    start = Pose(0.3, 0.3, 0.4)
    robot.place(start, 5)
    assert tuple(robot.pose) == pytest.approx(start, abs=1e-9)
    say(robot, packet(109, 200, 160), 3.0)
    alone = TwinRobot(quiet(), paper_arena(), number=5)
    alone.reset(start)
    # as a client of the real robot asks for these bytes: left .6, right 1
    alone.order(0.6, 1.0)
    alone.wait(3.0)
    assert math.dist(robot.pose[:2], alone.pose[:2]) < 2e-3
    assert math.remainder(robot.pose.heading - alone.pose.heading, math.tau) == pytest.approx(0.0, abs=0.02)


def test_encoders_count_what_the_twins_do():
    robot = emulated(quiet(encoders={"gain_left": 1.2}))
    robot.place(Pose(0.2, 0.3, 0.0), 0)
    say(robot, packet(109, 200, 200), 2.0)
    answer = ask(robot, 171, 1)
    # the Scribbler's own encoders look to the other end: its right wheel is the twin's left one
    left, right = signed(answer[:4]), signed(answer[4:])
    assert right / left == pytest.approx(1.2, rel=1e-3)
    assert -left * 0.00025 == pytest.approx(0.15 * (2.0 - 0.11), rel=0.03)


def test_pushing_at_a_wall_is_a_stall_after_a_while_and_the_path_goes_on():
    robot = emulated(quiet())
    robot.place(Pose(0.8, 0.3, 0.3), 0)
    say(robot, packet(109, 200, 200), 0.5)
    assert robot.pose.x > 0.8
    assert not robot.table.stalled
    robot.advance(4.0)
    path = robot.path()
    assert robot.table.stalled
    assert path[-1, 0] == pytest.approx(robot.now, abs=0.1)
    assert path[:, 1].max() < 42 * 0.0254 - 0.07


def test_it_rolls_out_after_the_motors_are_off():
    robot = emulated(quiet(motors={"delay": 0.3}))
    robot.place(Pose(0.2, 0.3, 0.0), 0)
    say(robot, packet(109, 200, 200), 1.0)
    say(robot, packet(108), 0.0)
    at = robot.pose
    robot.advance(1.0)
    assert math.dist(robot.pose[:2], at[:2]) == pytest.approx(0.3 * 0.15, rel=0.1)
    after = robot.pose
    robot.advance(5.0)
    assert robot.pose == after


def test_a_twin_keeps_rolling_when_its_delay_grows():
    """Once, it stopped until as many commands had arrived as its new delay spans."""
    twin = quiet(motors={"delay": 0.15, "delay_jitter": 0.15})
    body = TwinBody(twin, paper_arena())
    body.place(Pose(0.3, 0.3, 0.0))
    ways = [body.advance(0.1, 0.1, STEP_S) for _ in range(700)]
    rolling = np.array(ways)[100:].mean(axis=1)  # 3 s, in which its delay is drawn six times
    assert rolling.min() > 0.9 * 0.1 * STEP_S


def test_its_battery_is_what_the_gauge_reads():
    robot = emulated(quiet())
    assert robot.battery.volts(0.0) == pytest.approx(8.0)
    say(robot, packet(109, 200, 200), 0.5)
    assert robot.battery.volts(1.0) == pytest.approx(7.5)


def fluke_readings(model, distance, n=12):
    with Scribbler(open_port(model), reading_max=6400) as robot:
        witness = robot.link.port.witness
        readings = []
        for seed in range(n):
            witness.place(Pose(42 * 0.0254 - 0.089 - distance, 0.3, 0.0), seed)
            readings.append(robot.obstacle())
        return np.array(readings)


def open_port(model, **options):
    import tempfile
    from pathlib import Path

    import serial

    file = Path(tempfile.mkdtemp()) / "twin.toml"
    file.write_text(model.to_toml(), "utf-8")
    more = "".join(f"&{key}={value}" for key, value in options.items())
    return serial.serial_for_url(f"emulator://s2?fluke=2&twin={file}&speed=off{more}", timeout=1)


def test_the_fluke_counts_as_the_twin_does():
    near, half, far = (fluke_readings(quiet(), d) for d in (0.03, 0.12, 0.35))
    assert set(np.unique(np.concatenate([near, half, far])) % 640) == {0}
    assert near.mean() > 6200
    assert half.mean() == pytest.approx(3200, rel=0.2)
    assert far.mean() < 400
    weak = fluke_readings(quiet(ir={"half": 0.06}), 0.12)
    assert weak.mean() < 0.4 * half.mean()


def wander(robot, seed):
    random = np.random.default_rng(seed)
    for step in range(60):
        near = max(robot.observe().readings) > 0.4
        turn = random.uniform(-0.2, 0.2)
        robot.drive(Command(-0.3, 0.9 if step // 10 % 2 else -0.9) if near else Command(1.0, turn))


def test_coverage_with_the_real_driver_agrees_with_the_twin_alone():
    """Each mean of 8 trials has a standard error of about 2 cells: chance alone fails this once in 10,000 draws."""
    model = sample_twin("close", 2)
    start = paper_arena().start
    with Scribbler(open_port(model, timing="off"), reading_max=6400) as robot:
        witness = robot.link.port.witness
        driven = []
        for seed in range(8):
            robot.reset()
            witness.place(start, seed)
            wander(robot, seed)
            robot.stop()
            driven.append(len(witness.cells()))
    alone = TwinRobot(model, paper_arena())
    covered = []
    for seed in range(8):
        alone.number = 100 + seed
        alone.reset()
        wander(alone, seed)
        covered.append(len(alone.visited_cells))
    assert min(driven) > 10
    error = math.sqrt((np.var(driven, ddof=1) + np.var(covered, ddof=1)) / 8)
    assert abs(np.mean(driven) - np.mean(covered)) < 4 * error


def test_trials_of_one_seed_are_the_same():
    ends = []
    for _ in range(2):
        with Scribbler(open_port(sample_twin("worn", 1), timing="off"), reading_max=6400) as robot:
            robot.link.port.witness.place(paper_arena().start, 9)
            for _ in range(6):
                robot.observe()
                robot.drive(Command(0.7, 0.2))
            ends.append((robot.link.port.witness.pose(), robot.observe().raw))
    assert ends[0] == ends[1]


def test_a_bad_file_of_a_twin_is_refused(tmp_path):
    import serial

    file = tmp_path / "twin.toml"
    file.write_text('format = "realitygap twin 1"\n[wheels]\ntrack = 9\n', "utf-8")
    with pytest.raises(RobotError, match=r"wheels\.track: expected at most 0.4, got 9"):
        serial.serial_for_url(f"emulator://s2?twin={file}&speed=off")
    with pytest.raises(RobotError, match="There is no twin file"):
        serial.serial_for_url("emulator://s2?twin=none.toml&speed=off")
    file.write_text(sample_twin("same", 1).to_toml(), "utf-8")
    with pytest.raises(RobotError, match="engine 'sim'"):
        serial.serial_for_url(f"emulator://s2?twin={file}&speed=off")
