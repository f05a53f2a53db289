"""The robot file `thymio` and the platform `enki` against Enki itself, and the harness that runs it."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realitygap.errors import RobotError
from realitygap.families.thymio import EnkiPlatform, build_enki
from realitygap.families.thymio.enki import _build
from realitygap.families.thymio.enki._build import harness_path
from realitygap.families.thymio.enki._harness import Harness, arena_lines
from realitygap.platforms import (
    SimPlatform,
    open_target,
    platform_class,
)
from realitygap.robots import Command
from realitygap.testing import check_platform
from realitygap.trials import TrialPlan
from realitygap.world import Arena, Floor, Grid, Obstacle, Pose, load_arena, load_robot, paper_arena
from tests.commands import run_command
from tests.harness import needs_enki

ARENA = paper_arena()
WIDTH, DEPTH = 1.0668, 0.6096
DELAY_S = 0.1 / 3
"""In Enki a command begins one step late; here a command has three."""
ENKIS_DRIVE = {"drive.lag": 0.0, "drive.delay": DELAY_S, "contact.friction": 0.0, "contact.ang": 1e-6}


@pytest.fixture(name="built", scope="module")
def _built() -> Path:
    return build_enki()


def free_poses(n: int, seed: int) -> list[Pose]:
    """Poses in the paper's arena in which the body is at least 3 mm from the walls."""
    corners = np.array(load_robot("thymio").body[0].corners)
    rng, found = np.random.default_rng(seed), []
    while len(found) < n:
        x, y, heading = rng.uniform((0, 0, -math.pi), (WIDTH, DEPTH, math.pi)).tolist()
        turned = corners @ [[math.cos(heading), math.sin(heading)], [-math.sin(heading), math.cos(heading)]]
        low, high = turned.min(0) + np.array([x, y]), turned.max(0) + np.array([x, y])
        if (low > 0.003).all() and (high < (WIDTH - 0.003, DEPTH - 0.003)).all():
            found.append(Pose(x, y, heading))
    return found


def on_sim(**changed: Any) -> Any:
    platform = SimPlatform(robot="thymio", noise=False, precision="double", **changed)
    return platform.open_robot(ARENA)


@needs_enki
@pytest.mark.slow
def test_sensors_of_the_robot_file_agree_with_enki_within_2_percent_at_200_poses(built: Path) -> None:
    """Noise alone fails none: 2 % are 31 standard deviations of Enki's infrared.

    Enki looks at a wall only if the middle ray of a sensor would reach it, so that now and then an outer ray is
    left out and the sensor reads 0.
    """
    enki, sim = EnkiPlatform().open_robot(ARENA), on_sim()
    differences, missed = [], 0
    for number, pose in enumerate(free_poses(200, seed=1)):
        enki.number = number
        enki.reset(pose)
        sim.reset(pose)
        ours, theirs = np.array(sim.observe().readings), np.array(enki.observe().readings)
        is_missed = (theirs == 0) & (ours > 0.02)
        missed += int(is_missed.sum())
        differences.append(np.where(is_missed, 0.0, ours - theirs))
    assert np.abs(differences).max() < 0.02
    assert (np.abs(differences) > 0).sum() > 300
    assert missed <= 3


@needs_enki
def test_sensors_agree_with_enki_at_obstacles(built: Path) -> None:
    box = Obstacle(0.5, 0.3, 0.4, ((0.05, 0.03), (-0.05, 0.03), (-0.05, -0.03), (0.05, -0.03)))
    disc = Obstacle(0.8, 0.3, radius=0.04)
    arena = Arena("things", ARENA.walls, ARENA.grid, Pose(0.2, 0.2, 0.0), (box, disc))
    enki = EnkiPlatform().open_robot(arena)
    sim = SimPlatform(robot="thymio", noise=False, precision="double").open_robot(arena)
    for pose in (Pose(0.35, 0.3, 0.0), Pose(0.66, 0.3, 0.0), Pose(0.93, 0.3, math.pi), Pose(0.5, 0.14, 1.5)):
        enki.reset(pose)
        sim.reset(pose)
        assert enki.observe().readings == pytest.approx(sim.observe().readings, abs=0.02), pose
        assert max(sim.observe().readings) > 0.3


@needs_enki
def test_line_sensors_agree_with_enki_on_white_and_on_tape(built: Path) -> None:
    """Means of 25 readings: 2 % are 8 standard deviations, so that chance alone never fails it."""
    floor = Floor(tape=((0.5, 0.05, 0.5, 0.25),), tape_width=0.06)
    arena = Arena("tape", ARENA.walls, ARENA.grid, Pose(0.2, 0.2, 0.0), floor=floor)
    enki = EnkiPlatform().open_robot(arena)
    enki.select(("line.0", "line.1"))
    for x, y, expected in ((0.2, 0.15, 0.0), (0.5 - 0.072, 0.15, 1.0), (0.5 - 0.072, 0.45, 0.0)):
        values = []
        for number in range(25):
            enki.number = number
            enki.reset(Pose(x, y, 0.0))
            values.append(enki.observe().channels["line.0"])
        assert np.mean(values) == pytest.approx(expected, abs=0.02)


@needs_enki
def test_free_driving_agrees_with_enki_within_its_noise(built: Path) -> None:
    """Means of 40 trials: 4.5 standard errors of each of three numbers, so that chance fails one test in 50,000."""
    enki, sim = EnkiPlatform().open_robot(ARENA), on_sim(set=ENKIS_DRIVE)
    start = Pose(0.3, 0.3, 0.3)
    commands = [Command(1.0, 0.0)] * 8 + [Command(0.5, 0.5)] * 4 + [Command(-0.6, -0.1)] * 6
    sim.reset(start)
    for command in commands:
        sim.drive(command)
    ends = []
    for number in range(40):
        enki.number = number
        enki.reset(start)
        for command in commands:
            enki.drive(command)
        ends.append(tuple(enki.pose))
    spread = np.std(ends, axis=0, ddof=1) / math.sqrt(len(ends))
    rounding = 0.0005  # the robot file has 300 levels of speed
    assert (np.abs(np.mean(ends, axis=0) - tuple(sim.pose)) < 4.5 * spread + rounding).all()


@needs_enki
@pytest.mark.slow
def test_noise_of_the_robot_file_is_about_enkis(built: Path) -> None:
    """Standard deviations of 60 headings: chance alone fails one test in 2,000."""
    plans = [
        TrialPlan(start=Pose(0.2, 0.3, 0.0), commands=np.tile([1.0, 0.0], (60, 1)), number=k)
        for k in range(60)
    ]
    with open_target("sim:thymio", ARENA) as target:
        ours = [math.remainder(trial.poses[-1, 2], math.tau) for trial in target.carry_out(plans, "track")]
    with open_target("enki", ARENA) as target:
        theirs = [math.remainder(trial.poses[-1, 2], math.tau) for trial in target.carry_out(plans, "track")]
    assert 0.6 < np.std(ours) / np.std(theirs) < 1.6


@needs_enki
def test_contact_stops_at_the_same_place_and_does_not_turn(built: Path) -> None:
    enki, sim = EnkiPlatform().open_robot(ARENA), on_sim(set=ENKIS_DRIVE)
    for start, move in (
        (Pose(0.95, 0.3, 0.0), 1.0),
        (Pose(0.06, 0.3, 0.0), -1.0),
        (Pose(0.9, 0.2, 0.4), 1.0),
    ):
        for robot in (enki, sim):
            robot.reset(start)
            for _ in range(10):
                robot.drive(Command(move, 0.0))
        assert enki.observe().stalled
        assert sim.observe().stalled or start.heading  # sim does not call it a stall that a robot slides
        assert enki.pose.x == pytest.approx(sim.pose.x, abs=0.001)
        # sliding has the noise of the wheels: 0.5 mm and 0.01 rad after 10 cm
        assert enki.pose.y == pytest.approx(sim.pose.y, abs=0.005)
        assert enki.pose.heading == pytest.approx(sim.pose.heading, abs=0.03)
    assert enki.pose.y > 0.23


@needs_enki
def test_platform_keeps_the_contract(built: Path) -> None:
    check_platform(EnkiPlatform())
    assert platform_class("enki") is EnkiPlatform
    with open_target("enki", ARENA) as target:
        assert (target.label, target.n_sensors, target.observes) == ("EMULATED", 7, "track")
        assert "Enki" in target.identity
        assert {"range.6", "line.1", "encoder.0"} <= set(target.inputs or ())
        plans = [TrialPlan(commands=np.tile([1.0, 0.1], (90, 1)), number=k) for k in (3, 4, 3)]
        first, other, again = target.carry_out(plans, "track")
    assert np.array_equal(first.poses, again.poses)
    assert np.array_equal(first.readings, again.readings)
    assert not np.array_equal(first.poses, other.poses)
    assert first.stalled.any()
    assert first.wheels.shape == (91, 2)


@needs_enki
def test_a_harness_that_ends_is_an_error_and_wrong_lines_are_refused(built: Path) -> None:
    harness = Harness(ARENA)
    for line in ("put 1 2", "drive 1 1 0 0.03", "fly", "polygon 1 2 3 4", "world 10 10 2 2 0 0 0", "seed x"):
        assert harness._ask(line) == "error", line
    harness.close()
    harness.close()
    with pytest.raises(RobotError, match="has ended"):
        harness.sense()


@needs_enki
@pytest.mark.slow
def test_build_enki_prints_the_path_and_names_what_is_missing(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("REALITYGAP_CACHE", str(tmp_path))
    with pytest.raises(RobotError, match="realitygap twin build-enki"):
        EnkiPlatform().open_robot(ARENA)
    assert build_enki() == harness_path()
    harness_path().chmod(0o777)
    with pytest.raises(RobotError, match="Others can write"):
        EnkiPlatform().open_robot(ARENA)
    source = tmp_path / "harness.cpp"
    source.write_text("#include <enki/NoSuchHeader.h>\n")
    monkeypatch.setattr(_build, "SOURCE", source)
    with pytest.raises(RobotError, match=r"NoSuchHeader.*g\+\+ and libenki-dev"):
        build_enki()


@needs_enki
@pytest.mark.slow
def test_build_enki_is_a_command(tmp_path: Path) -> None:
    done = run_command("twin", "build-enki", env={**os.environ, "REALITYGAP_CACHE": str(tmp_path)})
    assert done.stdout.startswith(f"Built: {tmp_path}")


def test_build_enki_without_a_compiler_names_the_packages(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(RobotError, match=r"There is no g\+\+.*apt-get install g\+\+ libenki-dev"):
        build_enki()
    assert _build.SOURCE.is_file()


def test_arenas_become_lines_in_centimeters_from_their_corner() -> None:
    walls = ((1.0, 1.0, 2.0, 1.0), (2.0, 1.0, 2.0, 1.5), (2.0, 1.5, 1.0, 1.5), (1.0, 1.5, 1.0, 1.0))
    grid, start = Grid(1.0, 1.0, 0.1, 10, 5), Pose(1.2, 1.2, 0.0)
    assert list(arena_lines(Arena("room", walls, grid, start))) == ["world 100.0 50.0"]
    inner = Arena("inner", (*walls, (1.2, 1.2, 1.2, 1.4)), grid, start, (Obstacle(1.5, 1.25, radius=0.05),))
    box, disc = [line.split() for line in list(arena_lines(inner))[1:]]
    assert [box[0], *map(float, box[1:])] == ["box", *map(pytest.approx, (20, 30, 20, 0.2, math.pi / 2))]
    assert [disc[0], *map(float, disc[1:])] == ["disc", *map(pytest.approx, (50, 25, 5))]
    assert next(arena_lines(Arena("open", walls[:2], grid, start))) == "world"
    open_floor = Arena("open", walls[:2], grid, start, floor=Floor(tape=((1.1, 1.1, 1.2, 1.1),)))
    with pytest.raises(ValueError, match="no rectangle of walls"):
        list(arena_lines(open_floor))


def test_arenas_with_drawn_numbers_and_noise_are_refused() -> None:
    drawn = ARENA.with_numbers({"arena.start.x": {"uniform": [0.2, 0.3]}})
    with pytest.raises(ValueError, match="are drawn, expected plain numbers on platform 'enki'"):
        EnkiPlatform().check(drawn, ("range.0",), 0.0)
    with pytest.raises(ValueError, match="readings are noisy by themselves"):
        EnkiPlatform().check(ARENA, ("range.0",), 0.1)
    assert load_arena("avoid").obstacles is not None
