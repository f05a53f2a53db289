"""`realitygap import`, and fits to logs and tables of other programs."""

import json

import numpy as np
import pytest

from realitygap.calibration import predict_range_table
from realitygap.errors import RealityGapError
from realitygap.evolution import NeatSettings, Population
from realitygap.platforms import open_target
from realitygap.records import read_observations
from realitygap.world import load_calibration, load_robot, paper_arena
from tests.logs.made import SPEED, TRACK, drive, rows, wall_table, write, write_sample

from . import invoked
from .invoked import printed as run

MAP = f"""\
robot = "pioneer"
speed = {SPEED}
track = {TRACK}
commands = {{ time = "t", left = "left", right = "right" }}
poses = {{ time = "t", x = "x", y = "y", heading = "heading" }}
"""


DISC = """\
name = "disc"
body = [{ radius_mm = 27.5 }]
drive = { speed = 0.1, track_mm = 50 }
[each.range]
cone_deg = 20
rays = 5
reach_mm = 60
response = "ir"
amplitude = 2.0
decay_mm = 20
[[range]]
x_mm = 9
y_mm = 25
direction_deg = 70
[[range]]
x_mm = 25
y_mm = 9
direction_deg = 20
[[range]]
x_mm = 25
y_mm = -9
direction_deg = -20
[[range]]
x_mm = 9
y_mm = -25
direction_deg = -70
"""


def refused(*arguments):
    message = invoked.refused(*arguments)
    assert "\n" not in message
    return message


@pytest.fixture
def log(tmp_path):
    (tmp_path / "drive.map.toml").write_text(MAP, "utf-8")
    return write(tmp_path / "drive.csv", rows(*drive(80)))


def test_import_writes_trials_and_reports_what_it_did(log, tmp_path):
    out = tmp_path / "trials.jsonl"
    printed = run("import", log, "-o", out)
    assert "(REAL): 1 trial, 80 steps, 8 s; commands, poses" in printed
    assert "Poses follow commands by 0.00 s" in printed
    assert "Check" not in printed
    kept = read_observations(out)
    assert (kept.head.label, kept.head.observe, kept.head.robot) == ("REAL", "track", "pioneer")
    commands, poses = drive(80)
    (trial,) = kept.trials
    assert trial.poses == pytest.approx(poses)
    assert trial.commands == pytest.approx(
        np.stack([commands.mean(1), (commands[:, 1] - commands[:, 0]) / 2], 1), abs=1e-9
    )
    report = json.loads(run("import", log, "-o", out, "--step", "0.2", "--json"))
    assert (report["n_steps"], report["step_s"]) == (40, 0.2)


def test_several_logs_of_one_robot_are_its_trials(log, tmp_path):
    """The last one of several counted, in silence."""
    folder = tmp_path / "runs"
    folder.mkdir()
    for number in range(3):
        write(folder / f"{number}.csv", rows(*drive(60 + number, seed=number)))
    shared = log.with_name("drive.map.toml")
    (folder / "notes.md").write_text("no log", "utf-8")
    out = tmp_path / "trials.jsonl"
    files = [folder / f"{number}.csv" for number in range(3)]
    for names in ([folder], [folder / "*.csv"], [folder / "?.csv"], files, [files[0], folder / "[12].csv"]):
        assert "3 trials, 183 steps" in run("import", *names, "--map", shared, "-o", out)
        assert [trial.number for trial in read_observations(out).trials] == [0, 1, 2]
    fit = tmp_path / "fit.toml"
    data = [word for file in files for word in ("--from", file)]
    for file in files:  # each with its own mapping
        file.with_name(f"{file.stem}.map.toml").write_text(MAP, "utf-8")
    printed = run("calibrate", "motion", *data, "-o", fit, "--step", 0.2)
    assert load_calibration(fit).trials == 3
    assert "Steps of 0.2 s." in printed
    assert "named twice" in refused("import", files[0], folder, "-o", out)
    assert "No file fits the pattern" in refused("import", folder / "*.parquet", "-o", out)
    files[1].with_name("1.map.toml").write_text(MAP.replace("pioneer", "thymio"), "utf-8")
    assert "robot is 'pioneer' in the mapping of" in refused(
        "calibrate", "motion", "--from", folder, "-o", fit
    )
    assert "Expected one, unless" in refused("calibrate", "sensors", *data, "-o", fit)
    (tmp_path / "empty").mkdir()
    assert "is a folder without a log" in refused("import", tmp_path / "empty", "-o", out)


def test_folder_is_one_log_if_the_mapping_names_its_files(log, tmp_path):
    folder = tmp_path / "parts"
    folder.mkdir()
    table = rows(*drive(60))
    write(folder / "told.csv", table[:, :3], "t,left,right")
    write(folder / "seen.csv", table[:, [0, 3, 4, 5]], "t,x,y,heading")
    shared = tmp_path / "parts.toml"
    shared.write_text(
        MAP.replace('{ time = "t", left', '{ file = "told.csv", time = "t", left').replace(
            '{ time = "t", x', '{ file = "seen.csv", time = "t", x'
        ),
        "utf-8",
    )
    assert "1 trial, 60 steps" in run("import", folder, "--map", shared, "-o", tmp_path / "trials.jsonl")


def test_import_and_calibrate_count_the_same_trials(log, tmp_path):
    commands, poses = drive(300)
    poses[60:70] = poses[180:190] = np.nan
    write(log, rows(commands, poses))
    assert "3 trials" in run("import", log, "-o", tmp_path / "trials.jsonl")
    run("calibrate", "motion", "--from", log, "-o", tmp_path / "fit.toml")
    assert load_calibration(tmp_path / "fit.toml").trials == 3


def test_import_reports_likely_mistakes(log, tmp_path):
    commands, poses = drive(300)
    write(log, rows(commands[:, ::-1], poses))
    assert "Check (swapped)" in run("import", log, "-o", tmp_path / "trials.jsonl")


def test_shown_mapping_is_a_mapping(log, tmp_path):
    log.with_name("drive.map.toml").unlink()
    shown = run("import", log, "--show-map")
    (tmp_path / "shown.toml").write_text('robot = "pioneer"\nspeed = 1.0\n' + shown, "utf-8")
    run("import", log, "--map", tmp_path / "shown.toml", "-o", tmp_path / "trials.jsonl")
    assert "does not name the robot that drove" in refused("import", log, "-o", tmp_path / "trials.jsonl")


def test_wrong_inputs_have_one_message(log, tmp_path):
    out = tmp_path / "trials.jsonl"
    assert "No file for the trials. Name one" in refused("import", log)
    assert "does not end in .jsonl" in refused("import", log, "-o", tmp_path / "trials.csv")
    assert "There is no file" in refused("import", tmp_path / "none.csv", "-o", out)
    assert "Cannot read the mapping" in refused("import", log, "--map", tmp_path / "none.toml", "-o", out)
    assert "Set speed in the mapping" in refused(
        "import", write(log, rows(2 * drive(80)[0], drive(80)[1])), "-o", out
    )
    assert not out.exists()
    fit = tmp_path / "fit.toml"
    calibrate = ("calibrate", "motion", "--from", log, "-o", fit)
    assert "--hold-out is '2', expected a share" in refused(*calibrate, "--hold-out", 2)
    assert "are only for --from with a log" in refused(
        "calibrate", "path", "--robot", "sim", "-o", fit, "--map", log
    )
    assert "is not a file of observed trials" in refused("calibrate", "contact", "--from", log, "-o", fit)
    assert "--radius-mm is only for sensors" in refused(*calibrate, "--radius-mm", 20)
    write(log, rows(-drive(300)[0], drive(300)[1]))
    assert "Both wheels are reversed" in refused(*calibrate)
    write(log, rows(*drive(80))[:, :3], "t,left,right")
    log.with_name("drive.map.toml").write_text(MAP.split("poses")[0], "utf-8")
    assert "has commands alone" in refused(*calibrate)


def test_log_of_a_known_controller_is_a_target(log, tmp_path):
    genome = Population(3, 2, NeatSettings(population=2), seed=1).ask()[0]
    genome.save(tmp_path / "controller.json")
    mapping = log.with_name("drive.map.toml")
    with pytest.raises(RealityGapError, match="controller = FILE in its mapping"):
        open_target(f"recorded:{log}", paper_arena())
    mapping.write_text(f'controller = "{tmp_path / "controller.json"}"\n' + MAP, "utf-8")
    with open_target(f"recorded:{log}", paper_arena()) as target:
        assert (target.label, target.observes, target.steps) == ("REAL", "readings", 80)
        assert target.controllers[0][0].to_json() == genome.to_json()


@pytest.mark.slow
def test_motion_is_fitted_to_a_log_and_compared(log, tmp_path):
    commands, poses = drive(400, noise=0.002)
    wrong = SPEED / 1.1  # the wheels are 10 % faster than the mapping says
    write(log, rows(commands * wrong / SPEED, poses))
    fit = tmp_path / "fit.toml"
    printed = run("calibrate", "motion", "--from", log, "-o", fit)
    assert "Not seen by the fit (REAL" in printed
    made = load_calibration(fit)
    errors = made.evidence["held_out"]["errors"]
    assert list(errors) == ["fitted", "nominal numbers", "nominal, uniform noise", "lookup table"]
    assert errors["fitted"] < 0.02 < errors["nominal numbers"]
    assert load_robot(fit).drive.gain_left == pytest.approx(1.1, abs=0.02)
    assert load_robot(fit).drive.speed == SPEED


@pytest.mark.slow
def test_motion_is_fitted_to_all_trials_of_a_log(log, tmp_path):
    """The longest trial was the only one that counted. Here it stands still but for a moment."""
    (tmp_path / "drive.map.toml").write_text(f'trial = "trial"\n{MAP}', "utf-8")
    tables = []
    for number, n in enumerate((120, 160, 120, 12)):
        commands, poses = drive(n, seed=number, noise=0.002)
        if n == 160:
            commands[20:], poses[21:] = 0.0, poses[20]
        table = rows(commands / 1.1, poses)
        tables.append(np.column_stack([np.full(len(table), number), table]))
    write(log, np.concatenate(tables), "trial,t,left,right,x,y,heading")
    fit = tmp_path / "fit.toml"
    run("calibrate", "motion", "--from", log, "-o", fit)
    made = load_calibration(fit)
    assert made.trials == 3
    assert any(note.startswith("The fit uses 3 of 4 trials. The others are too short") for note in made.notes)
    assert made.evidence["held_out"]["measure"].endswith("mean of 3 trials")
    gain = {each.name: each for each in made.fitted}["drive.gain"]
    assert gain.estimate == pytest.approx(1.1, abs=0.02)
    assert gain.identified


@pytest.mark.slow
def test_blocks_of_a_log_are_each_predicted(log, tmp_path):
    write(log, rows(*drive(160, seed=3, noise=0.002)))
    fit = tmp_path / "fit.toml"
    run("calibrate", "motion", "--from", log, "-o", fit, "--hold-out", "blocks")
    assert "mean of 4 blocks" in load_calibration(fit).evidence["held_out"]["measure"]


@pytest.mark.slow
def test_sensors_are_fitted_to_a_table_and_compared(tmp_path):
    base = tmp_path / "disc.toml"
    base.write_text(DISC, "utf-8")
    robot = load_robot(base)
    true = robot.with_numbers({f"range.{k}.decay": 0.012 for k in range(4)})
    cells = wall_table(true, 5 + 4 * np.arange(6), 36)
    noisy = np.clip(cells + np.random.default_rng(0).normal(0, 0.01, cells.shape), 0, 1)
    table = write_sample(tmp_path / "wall.sample", np.round(noisy * 1023), 5, 4, "{:.0f}")
    fit = tmp_path / "fit.toml"
    printed = run("calibrate", "sensors", "--from", table, "--base", base, "-o", fit)
    assert "Taken: bearings clockwise from the robot's heading" in " ".join(printed.split())
    assert "1023 is taken for the full scale" in printed
    errors = load_calibration(fit).evidence["held_out"]["errors"]
    assert errors["fitted"] < 0.02 < errors["nominal numbers"]
    assert load_robot(fit).range[2].decay == pytest.approx(0.012, rel=0.2)
    assert load_calibration(fit).verdict.startswith("The fit predicts better")
    made = run("calibrate", "sensors", "--from", table, "--radius-mm", 27.5, "-o", fit, "--hold-out", 0.3)
    assert "at 30% of the places" in " ".join(made.split())
    assert load_calibration(fit).evidence["held_out"]["errors"]["fitted"] < 0.05
    directions = [sensor.direction for sensor in load_robot(tmp_path / "fit.robot.toml").range]
    assert directions == pytest.approx([sensor.direction for sensor in robot.range], abs=0.3)
    assert "has 4 sensors" in refused(
        "calibrate", "sensors", "--from", table, "--base", "scribbler-s2-fluke2", "-o", fit
    )


@pytest.mark.slow
def test_bearings_of_a_text_table_may_count_from_each_sensor(tmp_path):
    """A table of a Thymio, whose sensors were turned around their own axes."""
    robot = load_robot("thymio")
    true = robot.with_numbers({f"range.{k}.half_width": 0.07 for k in range(5)})
    sensor, distance, bearing = (
        each.ravel()
        for each in np.meshgrid(range(5), np.arange(10, 140, 10), np.arange(-60, 61, 12), indexing="ij")
    )
    readings = predict_range_table(
        sensor, distance / 1000, np.radians(bearing), true, measured_from="sensor", bearing_from="sensor"
    )
    readings = np.clip(readings + np.random.default_rng(0).normal(0, 0.01, len(readings)), 0, 1)
    table = write(
        tmp_path / "wall.csv",
        np.column_stack([sensor, distance, bearing, readings]),
        "sensor,distance_mm,bearing_deg,reading",
    )
    fit = tmp_path / "fit.toml"
    command = ["calibrate", "sensors", "--from", table, "-o", fit]
    found = json.loads(run(*command, "--base", "thymio", "--json"))
    assert any("from each sensor's own direction" in note for note in found["notes"])
    errors = found["held_out"]["errors"]
    assert errors["fitted"] < 0.03 < errors["nominal numbers"]
    assert errors["fitted"] < errors["lookup table"]
    for k in range(5):
        assert found["numbers"][f"range.{k}.direction"] == pytest.approx(robot.range[k].direction, abs=0.05)
        assert found["numbers"][f"range.{k}.half_width"] == pytest.approx(0.07, rel=0.05)
    assert "seem to count from each sensor's own direction" in refused(*command, "--radius-mm", 27.5)
    mapping = tmp_path / "wall.map.toml"
    mapping.write_text('robot = "thymio"\nbearing_from = "body"\nclockwise = false\n', "utf-8")
    found = json.loads(run(*command, "--json"))
    assert "worse than a lookup table" in found["verdict"]
    assert not any("The mapping leaves open" in note for note in found["notes"])
    mapping.write_text('bearing_from = "sensor"\n', "utf-8")
    assert "the mapping has bearing_from = 'sensor'" in refused(*command, "--radius-mm", 27.5)
