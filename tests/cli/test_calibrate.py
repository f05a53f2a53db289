"""`realitygap calibrate`: unattended, led through at a terminal, from recorded data, and its mistakes."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from realitygap.calibration import Fit, path_plans
from realitygap.cli import _calibrate, _calibration_operator
from realitygap.platforms import SimPlatform, SimTarget
from realitygap.records import read_observations, write_observations
from realitygap.study import parse_length, save_calibration
from realitygap.study._calibrate.one import _still_said
from realitygap.study._targets import observations_head
from realitygap.trials import _target_robot
from realitygap.world import Fitted, load_calibration, load_robot, paper_arena

from . import invoked
from .invoked import printed

pytestmark = pytest.mark.slow

PORT = "scribbler:emulator://s2?fluke=2&arena=paper&seed=1&speed=off"


run, refused = partial(printed, "calibrate"), partial(invoked.refused, "calibrate")


@pytest.fixture(scope="module")
def sensors(tmp_path_factory) -> Path:
    """A folder with a calibration of the sensors of sim, at reduced size."""
    folder = tmp_path_factory.mktemp("sensors")
    run(*("sensors", "--robot", "sim", "--budget", 6, "-o", folder / "fit.toml", "--seed", 3))
    return folder


def test_sensors_of_a_simulation_are_measured_unattended_and_kept(sensors):
    made = load_calibration(sensors / "fit.toml")
    assert (made.kind, made.label, made.trials, made.robot) == ("sensors", "SIM", 6, "scribbler-s2-fluke2")
    assert load_robot(sensors / "fit.toml").range[1].decay == pytest.approx(made.numbers["range.1.decay"])
    kept = read_observations(sensors / "fit.trials.sqlite")
    assert [trial.purpose for trial in kept.trials] == ["sensors"] * 6
    assert {len(trial.readings) for trial in kept.trials} == {50}
    assert made.n_draws == 500
    assert any("fewer than 3 placements" in note for note in made.notes)


def test_the_same_command_takes_up_what_was_kept_and_a_larger_budget_adds_to_it(sensors):
    before = read_observations(sensors / "fit.trials.sqlite").trials
    out = json.loads(
        run("sensors", "--robot", "sim", "--budget", 7, "-o", sensors / "fit.toml", "--seed", 3, "--json")
    )
    after = read_observations(sensors / "fit.trials.sqlite").trials
    assert [trial.number for trial in after[:-1]] == [trial.number for trial in before]
    assert after[0].raw.tobytes() == before[0].raw.tobytes()
    assert out["trials"] == 7
    assert {each["name"] for each in out["fitted"]} >= {"range.0.amplitude", "range.2.burst"}


def test_recorded_trials_alone_give_the_same_fit_and_figure(sensors, tmp_path):
    data = tmp_path / "data.jsonl"
    kept = read_observations(sensors / "fit.trials.sqlite")
    write_observations(data, kept.head, kept.trials[:6])
    out = run("sensors", "--from", data, "-o", tmp_path / "again.toml", "--figure", tmp_path / "fit.svg")
    assert "range.0.decay" in out
    assert "Not identified: battery_per_v: Record with a full" in out
    first = run("sensors", "--from", data, "-o", tmp_path / "third.toml")
    assert "Written" in first
    made = [load_calibration(tmp_path / name) for name in ("again.toml", "third.toml")]
    assert made[0].numbers == made[1].numbers
    picture = (tmp_path / "fit.svg").read_text()
    assert "SIM: 300 readings of each range sensor" in picture
    assert "range.2 (SIM)" in picture


def test_an_emulated_robot_is_measured_with_a_ruler_and_not_seen_otherwise(tmp_path):
    out = run("path", "--robot", PORT, "-o", tmp_path / "path.toml", "--budget", 4)
    assert "(EMULATED)" in out
    assert "path.jyro_steps" in out
    kept = read_observations(tmp_path / "path.trials.sqlite").trials
    assert all(len(trial.poses) == 0 and len(trial.wheels) == 0 for trial in kept)
    assert all(trial.end_pose is not None for trial in kept)
    made = load_calibration(tmp_path / "path.toml")
    track = {each.name: each for each in made.fitted}["drive.track"]
    assert 0.13 < track.estimate < 0.17


def test_a_calibration_builds_on_an_earlier_one(sensors, tmp_path):
    run("path", "--robot", "sim", "--base", sensors / "fit.toml", "-o", tmp_path / "both.toml", "--budget", 4)
    made, below = load_calibration(tmp_path / "both.toml"), load_calibration(sensors / "fit.toml")
    assert made.robot == "scribbler-s2-fluke2"
    assert made.numbers["range.1.decay"] == below.numbers["range.1.decay"]
    assert set(made.draws) == {*below.draws, "drive.gain_left", "drive.gain_right", "drive.track"}
    assert made.n_draws == 500
    assert sorted(made.draws["range.1.decay"]) == sorted(below.draws["range.1.decay"])
    robot = load_robot(tmp_path / "both.toml")
    assert robot.drive.track == pytest.approx(made.numbers["drive.track"])


class Person:
    """Types these answers, and notes what was asked."""

    def __init__(self, *answers: str) -> None:
        self.answers = list(answers)
        self.asked: list[str] = []

    def __call__(self, question: str) -> str:
        self.asked.append(question)
        return self.answers.pop(0)


@pytest.fixture
def person(monkeypatch):
    """Lets somebody answer at the terminal, before an emulated robot that counts as one that nobody places."""

    def answering(*answers: str) -> Person:
        somebody = Person(*answers)
        monkeypatch.setattr(_calibration_operator, "_ask_at_terminal", somebody)
        monkeypatch.setattr(_calibrate, "needs_operator", lambda robot, witness: True)
        return somebody

    return answering


STRAIGHT, TURN = ("", "13 3/4", "-1/8", "2"), ("", "281")


def test_a_person_is_led_through_can_stop_and_go_on_and_take_a_trial_back(person, tmp_path):
    command = ("path", "--robot", PORT, "-o", tmp_path / "path.toml", "--budget", 4)
    first = person(*STRAIGHT, *TURN, "q")
    out = run(*command)
    assert "Trial 1 of 4: put it with 24 in free ahead" in out
    assert "It turns for 5 full steps" in out
    assert "Run the same command to resume" in out
    assert not (tmp_path / "path.toml").exists()
    assert not first.answers
    kept = read_observations(tmp_path / "path.trials.sqlite").trials
    assert len(kept) == 2
    ahead, left, heading = kept[0].end_pose
    assert ahead - kept[0].start[0] == pytest.approx(13.75 * 0.0254)
    assert left - kept[0].start[1] == pytest.approx(-0.125 * 0.0254)
    assert heading == pytest.approx(0.0349, abs=1e-4)
    # the third trial, the fourth, back to the third, which is 14 in now, an answer mistyped, and the fourth again
    second = person(*("?", "r", *STRAIGHT), "r", *("", "x", "14", "0", "r"), *("", "14", "0", "0"), *TURN)
    out = run(*command)
    assert "Trial 1 of 2: put it with 24 in free ahead" in out
    assert "There is no previous trial." in out
    assert "'x' is not a number. Expected, for example, 13.75, 13 3/4, or -2." in out
    assert not second.answers
    made = load_calibration(tmp_path / "path.toml")
    assert made.evidence["path"]["straight_m"] == pytest.approx([13.75 * 0.0254, 14 * 0.0254], rel=1e-3)
    assert made.label == "EMULATED"


def test_a_trial_that_was_taken_back_does_not_count_whatever_follows(person, tmp_path):
    """It did where somebody stopped before it was driven again."""
    command = ("path", "--robot", PORT, "-o", tmp_path / "path.toml", "--budget", 4)
    person(*STRAIGHT, *TURN, "r", "q")
    run(*command)
    kept = read_observations(tmp_path / "path.trials.sqlite").trials
    assert [trial.end for trial in kept] == ["step limit", "aborted"]
    person("", "285", "", "14", "0", "0", "", "286")
    assert "Trial 1 of 3" in run(*command)
    made = load_calibration(tmp_path / "path.toml")
    turned = [math.radians(285), math.radians(286)]
    assert made.evidence["path"]["turned_rad"] == pytest.approx(turned, rel=1e-6)
    run("path", "--from", tmp_path / "path.trials.sqlite", "-o", tmp_path / "again.toml")
    assert load_calibration(tmp_path / "again.toml").evidence["path"]["turned_rad"] == pytest.approx(turned)


def test_a_robot_whose_link_is_lost_is_not_driven_again_before_somebody_puts_it_back(
    person, tmp_path, monkeypatch
):
    """It set off at once, from wherever it stood, and what it did was kept as begun at its start."""
    carry_out, n = _target_robot.carry_out_on_robot, []

    def losing(robot, plan, *more):
        n.append(plan.number)
        return replace(carry_out(robot, plan, *more), end="lost", problem="The link is gone.")

    monkeypatch.setattr(_target_robot, "carry_out_on_robot", losing)
    person("")
    command = ("path", "--robot", PORT, "-o", tmp_path / "path.toml", "--budget", 4)
    said = refused(*command)
    assert "was lost after 7 commands: The link is gone." in said
    assert n == [0]
    monkeypatch.setattr(_target_robot, "carry_out_on_robot", carry_out)
    person("q")
    assert "Trial 1 of 4" in run(*command)


def test_more_than_is_seen_is_refused_before_anything_is_done(person, tmp_path):
    nobody = person()
    file = tmp_path / "fit.toml"
    said = refused("contact", "--robot", PORT.replace("s2", "s1"), "--observe", "track", "-o", file)
    assert "supports at most 'cells'" in said
    assert not nobody.asked
    assert not list(tmp_path.iterdir())


def test_a_person_is_told_how_far_from_the_wall_the_robot_has_to_stand(person, tmp_path):
    person("", "", "q")
    out = run("sensors", "--robot", PORT, "-o", tmp_path / "fit.toml")
    assert "Trial 1 of 18: put it square to a wall, its sensors 3 in from it" in out
    assert "Trial 2 of 18: put it square to a wall, its sensors 6 in from it" in out
    assert "50 readings, on average" in out
    assert len(read_observations(tmp_path / "fit.trials.sqlite").trials) == 2


def test_without_a_terminal_nobody_is_led(monkeypatch, tmp_path):
    monkeypatch.setattr(_calibrate, "needs_operator", lambda robot, witness: True)
    said = refused("sensors", "--robot", PORT, "-o", tmp_path / "fit.toml")
    assert "There is no terminal" in said
    assert "--from FILE" in said


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("13.75", 13.75),
        ("13 3/4", 13.75),
        ("13-3/4", 13.75),
        ("-1/8", -0.125),
        (".5", 0.5),
        ("-2", -2.0),
        ("", None),
        ("1/0", None),
        ("13 3/0", None),
        ("13 3/00", None),
        ("13 in", None),
    ],
)
def test_numbers_are_read_as_on_a_ruler(text, value):
    assert parse_length(text) == value


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("sensors", "-o", "x.toml"), "Expected either the robot to measure (--robot PLATFORM)"),
        (
            ("sensors", "--robot", "sim", "--from", "x", "-o", "x.toml"),
            "Expected either the robot to measure",
        ),
        (("sensors", "--robot", "sim"), "No file for the calibration. Name one"),
        (("sensors", "--robot", "sim", "-o", "x.txt"), "does not end in .toml"),
        (("sensors", "--robot", "sim", "-o", "no/x.toml"), "There is no folder no"),
        (("sensor", "--robot", "sim", "-o", "x.toml"), "got 'sensor'. Did you mean 'sensors'?"),
        (("sensors", "--robot", "sym", "-o", "x.toml"), "'sym' is no platform"),
        (("path", "--robot", "sim", "--budget", "1", "-o", "x.toml"), "needs at least 2 trials"),
        (("path", "--robot", "sim", "--figure", "x.svg", "-o", "x.toml"), "--figure draws the readings"),
        (("sensors", "--robot", "sim", "--base", "e-puck", "-o", "x.toml"), "has 3 range sensors"),
        (("all", "--robot", "sim", "--base", "e-puck", "-o", "x.toml"), "name the target sim:e-puck"),
        (("sensors", "--from", "none.jsonl", "-o", "x.toml"), "There is no file none.jsonl"),
        (("sensors", "--robot", "sim", "--arena", "peper", "-o", "x.toml"), "Unknown arena"),
        (("all", "--robot", "sim", "--choose", "--budget", "9", "-o", "x.toml"), "at least 10"),
    ],
)
def test_mistakes_are_one_message_and_lose_nothing(arguments, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert says in refused(*arguments)
    assert not list(Path().iterdir())


def test_calibrate_never_overwrites_a_file_that_is_no_calibration(tmp_path):
    twin = tmp_path / "worn.toml"
    twin.write_text('format = "realitygap twin 1"\n')
    assert "is not a calibration: it was not changed" in refused("path", "--robot", "sim", "-o", twin)
    assert twin.read_text() == 'format = "realitygap twin 1"\n'


def path_trials(file: Path, numbers: dict[str, float], way: float = 1.0) -> Path:
    """Paths of a robot of sim with other numbers, that go so much of the way."""
    with SimTarget(SimPlatform(set=numbers), paper_arena()) as target:
        trials = target.carry_out(path_plans(target.arena, 4), "track")
        head = observations_head(target, "track")
    moved = [
        replace(trial, poses=trial.poses[0] + (trial.poses - trial.poses[0]) * [way, way, 1.0])
        for trial in trials
    ]
    write_observations(file, head, moved)
    return file


def test_a_robot_that_goes_back_makes_no_robot_and_one_beyond_what_was_thought_possible_is_flagged(tmp_path):
    back = path_trials(tmp_path / "back.jsonl", {}, way=-0.5)
    told = refused("path", "--from", back, "-o", tmp_path / "back.toml")
    assert "are not a valid robot: " in told
    assert "drive.gain_left: expected more than 0" in told
    assert not (tmp_path / "back.toml").exists()
    wide = path_trials(tmp_path / "wide.jsonl", {"drive.track": 0.25})
    out = run("path", "--from", wide, "-o", tmp_path / "wide.toml")
    assert "At or beyond the end of what was thought possible" in out
    made = load_calibration(tmp_path / "wide.toml")
    assert any("drive.track is 0.2" in note and "(0.107 to 0.199)" in note for note in made.notes)
    assert not made.misspecified  # `sim` makes it, with this track
    usual = path_trials(tmp_path / "usual.jsonl", {"drive.track": 0.16})
    assert "thought possible" not in run("path", "--from", usual, "-o", tmp_path / "usual.toml")


def test_a_flag_of_misspecification_passes_to_later_calibrations(sensors, tmp_path):
    file = tmp_path / "path.toml"
    run("path", "--from", path_trials(tmp_path / "path.jsonl", {"drive.track": 0.16}), "-o", file)
    flagged = load_calibration(file).model_copy(
        update={"misspecified": True, "misspecification_p": 0.01, "notes": ("What was said.",)}
    )
    save_calibration(file, flagged)
    data = sensors / "fit.trials.sqlite"
    run("sensors", "--from", data, "--base", file, "-o", tmp_path / "both.toml")
    made = load_calibration(tmp_path / "both.toml")
    assert (made.misspecified, made.misspecification_p) == (True, 0.01)
    assert "What was said." in made.notes


def test_refitted_parameters_are_not_listed_with_the_earlier_fit(tmp_path):
    def made(kind, names, numbers):
        rows = tuple(
            Fitted(
                name=name, estimate=1.0, low=0.9, high=1.1, prior_low=0.0, prior_high=2.0, identified=True, unit="",
                advice="",
            )
            for name in names
        )  # fmt: skip
        return Fit(rows, dict.fromkeys(numbers, 1.0), {}, kind)

    below = made(
        "path", ["path.sim_steps", "drive.gain", "drive.track", "range.0.decay", "range.amplitude"], []
    ).fitted
    above = made(
        "all", ["drive.gain", "range.decay", "range.1.amplitude"], ["drive.gain_left", "range.0.decay"]
    )
    assert [each.name for each in _still_said(below, above)] == ["drive.track"]
    turned = made("x", ["drive.track"], ["drive.track"])
    assert [each.name for each in _still_said(below, turned)] == [
        *("path.sim_steps", "drive.gain", "range.0.decay", "range.amplitude")
    ]


def test_trials_with_commands_of_another_length_are_left_out_and_named(tmp_path):
    """One slow trial ended the command with a traceback, after the last one, each time."""
    file = path_trials(tmp_path / "path.jsonl", {})
    found = read_observations(file)
    slow = replace(found.trials[3], step_s=0.58)
    more = [replace(trial, number=trial.number + 4) for trial in found.trials]
    write_observations(file, found.head, [*found.trials[:3], slow, *more])
    run("path", "--from", file, "-o", tmp_path / "fit.toml")
    made = load_calibration(tmp_path / "fit.toml")
    assert any(
        "1 of 8 trials were left out: their commands lasted 0.58 to 0.58 s" in note for note in made.notes
    )
    assert (made.trials, made.step_s, len(made.evidence["path"]["turned_rad"])) == (8, 0.5, 3)


def test_paths_that_end_at_a_wall_are_left_out(tmp_path):
    """They were taken for shorter ones: a robot of any speed had the gain that the arena had room for."""
    file = path_trials(tmp_path / "path.jsonl", {})
    found = read_observations(file)
    at_wall = found.trials[0].poses.copy()
    at_wall[-1, 0] = 42 * 0.0254 - 0.09
    stopped = replace(found.trials[0], poses=at_wall, number=9)
    write_observations(file, found.head, [*found.trials, stopped])
    run("path", "--from", file, "-o", tmp_path / "fit.toml")
    made = load_calibration(tmp_path / "fit.toml")
    assert "1 of 3 straight paths ended at a wall, and were left out." in made.notes
    assert made.numbers["drive.gain_left"] == pytest.approx(1.0, abs=0.1)
    write_observations(
        file, found.head, [found.trials[1], stopped, replace(stopped, number=10), found.trials[3]]
    )
    assert "All 2 straight paths ended at a wall" in refused(
        "path", "--from", file, "-o", tmp_path / "x.toml"
    )
    # a wall beside the path, 0.1 m from its line, stops nothing
    run("path", "--robot", "sim", "--arena", "wall", "--budget", 4, "-o", tmp_path / "beside.toml")
    slow = [replace(trial, step_s=2.0) for trial in found.trials]
    write_observations(file, found.head, slow)
    assert "turns cannot be counted" in refused("path", "--from", file, "-o", tmp_path / "x.toml")


def test_recorded_trials_of_another_robot_or_without_an_arena_are_one_message(tmp_path):
    file = path_trials(tmp_path / "path.jsonl", {})
    said = refused("all", "--from", file, "--base", "e-puck", "-o", tmp_path / "x.toml")
    assert "have 3 range sensors and robot 'e-puck' 8" in said
    lines = file.read_text().splitlines()
    head = json.loads(lines[0])
    del head["arena"]["grid"]
    file.write_text("\n".join([json.dumps(head), *lines[1:]]) + "\n")
    said = refused("path", "--from", file, "-o", tmp_path / "x.toml")
    assert "its first line has no arena that can be read" in said


def test_data_without_what_is_to_be_fitted_is_refused(sensors, tmp_path):
    data = sensors / "fit.trials.sqlite"
    assert "There is no straight path" in refused("path", "--from", data, "-o", tmp_path / "x.toml")
    other = refused("sensors", "--from", data, "--base", "e-puck", "-o", tmp_path / "x.toml")
    assert "have 3 range sensors and robot 'e-puck' 8" in other


def test_motion_contact_and_all_are_dispatched_with_what_was_observed(tmp_path, monkeypatch):
    from realitygap.study._calibrate import kinds as _calibrate_kinds

    asked = {}

    def fit(kind):
        def fitted(trials, simulate, robot, arena, *, observe, seed):
            asked[kind] = trials, observe, seed
            poses = simulate([trials[0].start], trials[0].commands[None], {"drive.track": [0.15]}, 1).poses
            assert poses.shape == (1, 1, len(trials[0].commands) + 1, 3)
            return Fit((), {"drive.track": 0.15}, {"drive.track": (0.149, 0.151)}, method=kind)

        return fitted

    for kind in ("motion", "contact"):
        monkeypatch.setattr(_calibrate_kinds, f"fit_{kind}", fit(kind))
        out = tmp_path / f"{kind}.toml"
        run(kind, "--robot", "sim", "--observe", "track", "--budget", 2, "-o", out, "--seed", 5)
        made = load_calibration(out)
        assert (made.kind, made.method, made.numbers) == (kind, kind, {"drive.track": 0.15})
        trials, observe, seed = asked[kind]
        assert ([trial.purpose for trial in trials], observe, seed) == ([kind] * 2, "track", 5)
        assert all(len(trial.poses) for trial in trials)
    said = refused("motion", "--robot", "sim", "-o", tmp_path / "x.toml")
    assert "cells alone does not identify motion" in said
    assert "--observe encoders or track" in said
    said = refused("contact", "--robot", "sim", "--observe", "encoders", "-o", tmp_path / "x.toml")
    assert "--observe track" in said


def test_less_can_be_used_than_was_recorded_and_not_more(tmp_path):
    run("path", "--robot", "sim", "--observe", "track", "--budget", 4, "-o", tmp_path / "path.toml")
    data = tmp_path / "path.trials.sqlite"
    run("path", "--from", data, "--observe", "cells", "-o", tmp_path / "ruled.toml")
    made = [load_calibration(tmp_path / name) for name in ("path.toml", "ruled.toml")]
    ways = [each.evidence["path"]["straight_m"] for each in made]
    assert ways[0] != ways[1]
    assert ways[0] == pytest.approx(ways[1], abs=0.0254 / 16 + 1e-3)
    seen = tmp_path / "cells.toml"
    run("path", "--robot", "sim", "--budget", 4, "-o", seen)
    said = refused("path", "--from", tmp_path / "cells.trials.sqlite", "--observe", "track", "-o", seen)
    assert "has no more than 'cells'" in said


@pytest.mark.long
@pytest.mark.parametrize("kind", ["motion", "all"])
def test_every_number_of_sim_is_in_reach_of_its_calibration(kind, tmp_path):
    run(kind, "--robot", "sim", "--observe", "track", "--budget", 4, "-o", tmp_path / "fit.toml")
    made = load_calibration(tmp_path / "fit.toml")
    own = {each.name: each for each in made.fitted}
    assert own["drive.track"].identified
    assert own["drive.track"].estimate == pytest.approx(0.153, rel=0.05)
    assert made.n_draws > 50
