"""A number that is infinite or NaN is refused at each entry, before it reaches a robot, a kernel, or a file."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realitygap.calibration import motion_log, place_ranks
from realitygap.classroom import jyro
from realitygap.emulator import serve_tcp
from realitygap.errors import RealityGapError
from realitygap.evolution import Genome, NearestArchive, NeatSettings, PaperArchive, Population
from realitygap.families.scribbler import Scribbler
from realitygap.families.scribbler.emulator import BoxOnWheels, Emulator, Faults
from realitygap.families.thymio import Thymio
from realitygap.logs import read_range_table
from realitygap.platforms import JyroPlatform, SimEnsemble, SimPlatform, SimWorld, open_target, try_genomes
from realitygap.records import TrialRecord, trial_from_dict, trial_to_dict
from realitygap.report import audit_distance
from realitygap.robots import Command, Observation, VirtualClock, check_command, check_observation
from realitygap.robots.twin import sample_twin
from realitygap.runs import Condition, Evolution
from realitygap.stats import (
    controllers_for_margin,
    median_interval,
    plan_margin,
)
from realitygap.stats._planning import equivalence_power
from realitygap.study import parse_study
from realitygap.tasks import WallTask
from realitygap.trials import NoiseKey, TrialPlan, run_trial
from realitygap.vision import Lens, Marks, RobotTag, corner_tags, print_tags
from realitygap.world import (
    Arena,
    Body,
    Case,
    Distribution,
    Floor,
    FloorImage,
    Goal,
    Grid,
    Light,
    Obstacle,
    Pose,
    RangeSensors,
    load_arena,
    load_robot,
    paper_arena,
)

ARENA = paper_arena()
GENOME = Population(3, 2, seed=1).ask()[0]
KEY = NoiseKey(1)
HERE: Path
"""The folder for files of this test."""


def scribbler() -> Scribbler:
    return Scribbler("emulator://s2?fluke=2&speed=off")


def text_file(name: str, text: str) -> Path:
    path = HERE / name
    path.write_text(text)
    return path


def arena_with(**changes: Any) -> Arena:
    return Arena(**{"name": "a", "walls": (), "grid": ARENA.grid, "start": Pose(0.1, 0.1, 0.0), **changes})


def trial() -> TrialRecord:
    return run_trial(JyroPlatform().open_robot(ARENA), lambda seen, step: Command(0.1, 0.0), 1)


ENTRIES: dict[str, Callable[[float], object]] = {
    # networks, evolution, and archives
    "an input of a network": lambda x: GENOME.network().activate([0.0, x, 0.0]),
    "a fitness": lambda x: Population(3, 2, NeatSettings(population=2)).tell([1.0, x]),
    "a score": lambda x: Evolution(Condition(name="a"), 0).tell([x] * 8, [[1]] * 8),
    "a setting of NEAT": lambda x: NeatSettings(weight_step=x),
    "a behavior": lambda x: NearestArchive().update([[0.0, x]]),
    "a distance of behaviors": lambda x: NearestArchive(lambda a, b: x).update([[0.0], [1.0]]),
    "a threshold": lambda x: NearestArchive(threshold=x),
    "a cell": lambda x: PaperArchive().update([[x]]),
    "a network in a file": lambda x: Genome.from_json(json.dumps({**GENOME.to_dict(), "bias_value": x})),
    # commands and observations of robots
    "a command": lambda x: check_command(Command(0.0, x)),
    "an observation": lambda x: check_observation(Observation((0.0, x), False, (0.0,))),
    "a channel of an observation": lambda x: check_observation(Observation((), False, (), {"light.0": x})),
    "a command of a controller": lambda x: run_trial(
        JyroPlatform().open_robot(ARENA), lambda seen, step: Command(x, 0.0), 2
    ),
    "the start of a trial on jyro": lambda x: JyroPlatform().open_robot(ARENA).reset(Pose(x, 0.1, 0.0)),
    "the start of a trial on sim": lambda x: SimPlatform().open_robot(ARENA).reset(Pose(x, 0.1, 0.0)),
    "the commands of a plan": lambda x: open_target("sim", ARENA).carry_out(
        [TrialPlan(commands=np.array([[x, 0.0]]))], "cells"
    ),
    "the wheels of a Scribbler": lambda x: scribbler().motors(x, 0.0),
    "a sound of a Scribbler": lambda x: scribbler().beep(x, 880),
    "a step of a Scribbler": lambda x: Scribbler("emulator://s2?speed=off", step_s=x),
    "a scale of a Scribbler": lambda x: Scribbler("emulator://s2?speed=off", reading_max=x),
    "a watchdog": lambda x: Scribbler("emulator://s2?speed=off", watchdog_s=x),
    "a step of a Thymio": lambda x: Thymio("socket://127.0.0.1:1", step_s=x),
    "a wait": lambda x: VirtualClock().sleep(x),
    # platforms
    "the noise of jyro": lambda x: try_genomes(JyroPlatform(), ARENA, [GENOME], noise=x, noise_key=KEY),
    "the noise of sim": lambda x: try_genomes(SimPlatform(), ARENA, [GENOME], noise=x, noise_key=KEY),
    "a number of sim": lambda x: SimPlatform(set={"drive.speed": x}),
    "the commands of an ensemble": lambda x: SimEnsemble(SimPlatform(), ARENA).replay(
        [[0.1, 0.1, 0.0]], [[[x, 0.0]]], {}, 1
    ),
    "a step of a world of sim": lambda x: SimWorld(ARENA, step_s=x),
    "the time of a world of sim": lambda x: SimWorld(ARENA).run(x),
    "a robot in a world of sim": lambda x: SimWorld(ARENA).add().move(x, 0.0),
    "the noise of a robot in a world of sim": lambda x: SimWorld(ARENA).add(noise=x),
    # Jyro's worlds
    "a step of a world": lambda x: jyro.JyroWorld(step_s=x),
    "a wall": lambda x: jyro.JyroWorld().add_wall(0.0, 0.0, x, 1.0),
    "a box": lambda x: jyro.JyroWorld().add_box(0.0, 0.0, x, 1.0),
    "a polygon": lambda x: jyro.JyroWorld().add_polygon([(0.0, 0.0), (x, 0.0), (1.0, 1.0)]),
    "a lamp": lambda x: jyro.JyroWorld().add_light(0.0, 0.0, x),
    "the time of a world": lambda x: jyro.JyroWorld().run(x),
    "the place of a robot": lambda x: jyro.SceneRobot(x, 0.0),
    "the body of a robot": lambda x: jyro.SceneRobot(0.0, 0.0, body=[(x, 0.0)]),
    "the speed of a robot": lambda x: jyro.SceneRobot(0.0, 0.0).move(x, 0.0),
    "the speed ahead of a robot": lambda x: jyro.SceneRobot(0.0, 0.0).translate(x),
    "the turn of a robot": lambda x: jyro.SceneRobot(0.0, 0.0).rotate(x),
    "the odometry of a robot": lambda x: jyro.SceneRobot(0.0, 0.0).localize(x),
    # descriptions
    "a start": lambda x: paper_arena(Pose(x, 0.1, 0.0)),
    "another start": lambda x: arena_with(others=(Pose(0.1, x, 0.0),)),
    "a wall of an arena": lambda x: arena_with(walls=((0.0, 0.0, x, 1.0),)),
    "a grid": lambda x: Grid(0.0, 0.0, x, 3, 3),
    "a light": lambda x: Light(0.0, 0.0, x),
    "a goal": lambda x: Goal(0.0, 0.0, x),
    "an obstacle": lambda x: Obstacle(0.0, 0.0, corners=((0.0, x),)),
    "a floor": lambda x: Floor(tape=((0.0, 0.0, x, 1.0),)),
    "a floor image": lambda x: FloorImage.of(0.0, 0.0, x, np.zeros((1, 1), np.uint8)),
    "a body": lambda x: Body(((0.0, x),)),
    "range sensors": lambda x: RangeSensors(((0.0, 0.0, 0.0),), x),
    "a distribution": lambda x: Distribution(uniform=(0.0, x)),
    "a number of a robot": lambda x: load_robot("scribbler-s2").with_numbers({"drive.speed": x}),
    "a setting of a task": lambda x: WallTask(within=x),
    "a setting of a condition": lambda x: Condition(name="a", noise=x),
    # files
    "a study file": lambda x: parse_study(
        f'[study]\nname = "a"\n[[condition]]\nname = "b"\nnoise = {x}\n', "a"
    ),
    "an arena file": lambda x: load_arena(
        text_file("arena.toml", f"wall = [[0, 0, 1, {x}]]\nstart = [0, 0, 0]\n")
    ),
    "a robot file": lambda x: load_robot(
        text_file("robot.toml", f'base = "scribbler-s2"\n[drive]\nspeed = {x}\n')
    ),
    "a twin file": lambda x: open_target(
        f"twin:{text_file('twin.toml', twin_text().replace(f'seed = {TWIN_SEED}', f'seed = {x}'))}", ARENA
    ),
    "a case file": lambda x: Case.read(text_file("case.json", json.dumps({"world": {"boxes": [[0, 0, x]]}}))),
    "a table of readings": lambda x: read_range_table(
        text_file("table.csv", f"sensor,distance_m,reading\n0,{x},0.5\n")
    ),
    "a trial from a file": lambda x: trial_from_dict({**trial_to_dict(trial()), "commands": [[x, 0.0]]}),
    # logs and calibrations
    "a command of a log": lambda x: motion_log(
        np.arange(12.0), [[x, 0.0]] * 12, poses=[[0.0, 0.0, 0.0]] * 12
    ),
    "a distance in a table": lambda x: place_ranks([x], [0.0]),
    # measures of gaps
    "a margin": lambda x: plan_margin(x, spread=0.1, noise=0.1, trials=3),
    "the power for a margin": lambda x: equivalence_power(x, 0.1, 10),
    "a spread": lambda x: controllers_for_margin(0.1, x),
    "the probability of a step ahead": lambda x: audit_distance("paper", straight=x),
    "a confidence": lambda x: median_interval(np.arange(9.0), x),
    "a value of a run": lambda x: median_interval(np.array([1.0, x])),
    # emulators
    "a fault": lambda x: Faults(drop=x),
    "the speed of an emulator": lambda x: serve_tcp(Emulator("s2", "2"), speed=x),
    "the time of an emulator": lambda x: Emulator("s2", "2").advance(x),
    "the place of an emulator": lambda x: BoxOnWheels(ARENA, 0.1).place(Pose(x, 0.1, 0.0)),
    # tags and cameras
    "the size of a tag": lambda x: RobotTag(size=x),
    "the place of a tag": lambda x: RobotTag(ahead=x),
    "the place of corner tags": lambda x: corner_tags(ARENA, 0.01, x),
    "the size of corner tags": lambda x: Marks(ARENA, corner_size=x),
    "the size of printed tags": lambda x: print_tags(HERE / "tags.pdf", corner_size=x),
    "a lens": lambda x: Lens(10, 10, (x, 1.0), (1.0, 1.0)),
}
TWIN_SEED = 1


def twin_text() -> str:
    return sample_twin("same", TWIN_SEED).to_toml()


@pytest.mark.slow
def test_number_that_is_infinite_or_nan_is_refused_at_each_entry(tmp_path: Path) -> None:
    global HERE
    HERE = tmp_path
    accepted = []
    for entry, give in ENTRIES.items():
        for wrong in (math.nan, math.inf, -math.inf):
            try:
                give(wrong)
            except (ValueError, TypeError, RealityGapError) as error:
                if not re.search(
                    r"\b(nan|inf|infinity|no number|not all numbers)\b", str(error), re.IGNORECASE
                ):
                    accepted.append(f"{entry}, {wrong}: {error}")
            except Exception as error:
                accepted.append(f"{entry}, {wrong}: {type(error).__name__}: {error}")
            else:
                accepted.append(f"{entry}, {wrong}: accepted")
    assert not accepted, "\n".join(accepted)
