"""A log becomes trials on one grid, in meters, radians, and shares of full speed."""

import json

import numpy as np
import polars as pl
import pytest

from realitygap.errors import LogError
from realitygap.logs import LogMap, guess_log_map, import_log, load_log_map, read_logs, trial_of
from realitygap.world import load_robot
from tests.logs.made import SPEED, STEP_S, TRACK, drive, rows, write

ROBOT = load_robot("pioneer").with_numbers({"drive.speed": SPEED, "drive.track": TRACK})
COMMANDS = {"time": "t", "left": "left", "right": "right"}
POSES = {"time": "t", "x": "x", "y": "y", "heading": "heading"}


def log_map(**changed):
    return LogMap(**{"commands": COMMANDS, "poses": POSES, **changed})


def read(path, **changed):
    (log,) = read_logs(path, log_map(**changed), ROBOT)
    return log


def load_log_map_text(folder, text):
    (folder / "again.toml").write_text(text, "utf-8")
    return load_log_map(folder / "again.toml")


@pytest.fixture
def made(tmp_path):
    commands, poses = drive(60)
    return write(tmp_path / "log.csv", rows(commands, poses)), commands, poses


def test_regular_log_comes_back_as_it_was_driven(made):
    path, commands, poses = made
    log = read(path)
    assert log.step_s == pytest.approx(STEP_S)
    assert log.commands == pytest.approx(commands)
    assert log.poses == pytest.approx(poses)


def test_units_signs_and_frames_lead_to_the_same_log(tmp_path):
    commands, poses = drive(60)
    table = rows(commands, poses)
    t, left, right, x, y, heading = table.T
    mean, turn = (left + right) / 2, (right - left) / TRACK
    degrees = np.degrees(heading)
    variants = {
        "millimeters": (
            [t, 1000 * left, 1000 * right, 1000 * x, 1000 * y, heading],
            {"commands": {**COMMANDS, "unit": "mm/s"}, "poses": {**POSES, "unit": "mm"}},
        ),
        "degrees that wrap": (
            [t, left, right, x, y, (degrees + 180) % 360 - 180],
            {"poses": {**POSES, "heading_unit": "deg"}},
        ),
        "shares": (
            [t, left / SPEED, right / SPEED, x, y, heading],
            {"commands": {**COMMANDS, "unit": "share"}},
        ),
        "levels": (
            [t, left / SPEED * 127, right / SPEED * 127, x, y, heading],
            {"commands": {**COMMANDS, "unit": "level", "full": 127}},
        ),
        "rad/s": (
            [t, left / 0.02, right / 0.02, x, y, heading],
            {"commands": {**COMMANDS, "unit": "rad/s", "wheel_diameter_mm": 40}},
        ),
        "ticks/s": (
            [t, left * 5000, right * 5000, x, y, heading],
            {"commands": {**COMMANDS, "unit": "ticks/s", "ticks_per_m": 5000}},
        ),
        "speed and turn": (
            [t, mean, turn, x, y, heading],
            {"commands": {"time": "t", "forward": "left", "turn": "right"}},
        ),
        "reversed": (
            [t, -left, -right, x, y, heading],
            {"commands": {**COMMANDS, "left_sign": -1, "right_sign": -1}},
        ),
        "y down": ([t, left, right, x, -y, -heading], {"poses": {**POSES, "y_down": True}}),
        "clockwise": ([t, left, right, x, y, -heading], {"poses": {**POSES, "clockwise": True}}),
        "0 is along y": (
            [t, left, right, x, y, heading - np.pi / 2],
            {"poses": {**POSES, "heading_offset_deg": 90}},
        ),
        "a marker ahead": (
            [t, left, right, x + 0.05 * np.cos(heading), y + 0.05 * np.sin(heading), heading],
            {"poses": {**POSES, "marker_x_mm": 50}},
        ),
        "milliseconds": (
            [1000 * t, left, right, x, y, heading],
            {
                "commands": {**COMMANDS, "time_unit": "ms"},
                "poses": {**POSES, "time_unit": "ms"},
            },
        ),
    }
    for name, (columns, changed) in variants.items():
        log = read(write(tmp_path / "log.csv", np.column_stack(columns)), **changed)
        assert log.commands == pytest.approx(commands, abs=1e-9), name
        off = log.poses - poses
        off[:, 2] -= 2 * np.pi * np.round(off[:, 2].mean() / (2 * np.pi))
        assert np.abs(off).max() < 1e-9, name


def test_commands_are_means_over_longer_steps(made):
    path, commands, poses = made
    log = read(path, step_s=3 * STEP_S)
    assert log.commands == pytest.approx(commands.reshape(20, 3, 2).mean(1))
    assert log.poses == pytest.approx(poses[::3])


def test_poses_with_another_clock_are_interpolated(tmp_path):
    commands, poses = drive(60, noise=0.0)
    write(tmp_path / "odom.csv", rows(commands, poses)[:, :3], "t,left,right")
    at = 2.0 + 0.033 * np.arange(200)
    seen = np.column_stack(
        [at, *(np.interp(at - 2.0, STEP_S * np.arange(61), poses[:, k]) for k in range(3))]
    )
    write(tmp_path / "camera.csv", seen, "stamp,x,y,heading")
    pose_map = {**POSES, "file": "camera.csv", "time": "stamp", "offset_s": -2.0}
    log = read(tmp_path, commands={**COMMANDS, "file": "odom.csv"}, poses=pose_map)
    assert np.abs(log.poses - poses)[:, :2].max() < 0.002
    with pytest.raises(LogError, match=r"No row of \[poses\] is between 0 and 6 s"):
        read(tmp_path, commands={**COMMANDS, "file": "odom.csv"}, poses={**pose_map, "offset_s": 100.0})


def test_poses_that_were_not_seen_end_trials(made):
    path, _, poses = made
    table = np.genfromtxt(path, delimiter=",", skip_header=1)
    table[20:30, 3:] = np.nan
    logs = list(read_logs(write(path, table), log_map(), ROBOT))
    assert [len(log.commands) for log in logs] == [19, 30]
    assert [log.start_s for log in logs] == pytest.approx([0, 30 * STEP_S])
    assert trial_of(logs[1], log_map()).start == pytest.approx(tuple(poses[30]))
    assert any("10 of 61 rows have no numbers" in note for note in logs[0].notes)


def test_a_robot_that_a_person_carried_begins_another_trial(tmp_path):
    """The carrying takes 2 s, or one step. Poses in millimeters, noisy ones, and a late clock are no carrying."""
    commands, poses = drive(400, noise=0.002)
    path = tmp_path / "log.csv"
    for steps, moved in ((20, [0.9, 0.6, 2.0]), (1, [0.3, 0.0, 0.0])):
        share = np.clip((np.arange(401) - 150) / steps, 0, 1)[:, None]
        logs = list(read_logs(write(path, rows(commands, poses + share * moved)), log_map(), ROBOT))
        assert len(logs) == 2
        first, second = (log.start_s / STEP_S for log in logs)
        assert first == 0
        assert 150 + steps <= second <= 150 + 2 * steps + 12
        assert 130 <= len(logs[0].commands) <= 150
        assert "a person carried the robot" in logs[0].notes[-1]
    turns = poses + np.where(np.arange(401) > 150, 2.5, 0)[:, None] * [0, 0, 1]
    assert len(list(read_logs(write(path, rows(commands, turns)), log_map(), ROBOT))) == 2
    whole = {
        "millimeters": rows(commands, poses * [1000, 1000, 1]),
        "noise": rows(commands, poses + np.random.default_rng(1).normal(0, 0.02, poses.shape)),
        "late": rows(*drive(400, late=25)),
        "a robot file that is too slow": rows(commands / 2, poses),
        "a robot that is blocked": rows(
            np.concatenate([commands, commands]), np.repeat(poses, [1] * 400 + [401], 0)
        ),
    }
    for name, table in whole.items():
        assert len(list(read_logs(write(path, table), log_map(), ROBOT))) == 1, name


def test_counters_of_wheels_are_ways_since_the_start(tmp_path):
    commands, _ = drive(60)
    told = np.concatenate([commands, commands[-1:]]) * SPEED
    ways = np.concatenate([np.zeros((1, 2)), np.cumsum(commands * SPEED * STEP_S, 0)])
    t = STEP_S * np.arange(61)
    for wraps_at in (0, 2000):
        ticks = np.round(ways * 20_000) + 300
        table = np.column_stack([t, told, ticks % wraps_at if wraps_at else ticks])
        path = write(tmp_path / "log.csv", table, "t,left,right,el,er")
        wheels = {"time": "t", "left": "el", "right": "er", "unit": "ticks", "ticks_per_m": 20_000}
        mapped = LogMap(commands=COMMANDS, wheels={**wheels, "wraps_at": wraps_at})
        (log,) = read_logs(path, mapped, ROBOT)
        assert np.abs(log.wheels - ways).max() < 1e-4
    speeds = {"time": "t", "left": "left", "right": "right", "unit": "m/s"}
    (log,) = read_logs(path, LogMap(commands=COMMANDS, wheels=speeds), ROBOT)
    assert np.abs(log.wheels - ways).max() < 0.05


def test_increments_belong_to_the_interval_that_ends_at_their_row(tmp_path):
    commands, poses = drive(60)
    ways = np.concatenate(
        [np.full((1, 2), 0.7), commands * SPEED * STEP_S]
    )  # the first is from before the log
    mean, turn = ways.mean(1), (ways[:, 1] - ways[:, 0]) / TRACK
    table = np.column_stack([STEP_S * np.arange(61), ways, mean, turn, poses])
    path = write(tmp_path / "log.csv", table, "t,dl,dr,dc,da,x,y,heading")
    wheels = {"time": "t", "left": "dl", "right": "dr", "per": "row"}
    driven = np.concatenate([np.zeros((1, 2)), np.cumsum(ways[1:], 0)])
    both = LogMap(commands=wheels, wheels={**wheels, "unit": "ticks", "ticks_per_m": 1}, poses=POSES)
    twist = LogMap(commands={"time": "t", "forward": "dc", "turn": "da", "per": "row"}, poses=POSES)
    for mapped in (both, twist):
        (log,) = read_logs(path, mapped, ROBOT)
        assert log.commands == pytest.approx(commands)
        if len(log.wheels):
            assert log.wheels == pytest.approx(driven)
    assert load_log_map_text(tmp_path, both.to_toml()) == both


def test_increments_have_no_unit_of_a_speed_and_no_row_is_left_out(tmp_path):
    commands, poses = drive(60)
    table = rows(commands, poses)
    path = write(tmp_path / "log.csv", table)
    for part in ("commands", "wheels"):
        mapped = LogMap(
            **{"poses": POSES, part: {**COMMANDS, "per": "row", "unit": "ticks/s", "ticks_per_m": 9}}
        )
        with pytest.raises(
            LogError, match=f"{part}.unit is 'ticks/s', expected m,.*a distance since the row"
        ):
            list(read_logs(path, mapped, ROBOT))
    table[7, 1] = np.nan
    write(path, table)
    mapped = LogMap(wheels={**COMMANDS, "per": "row"}, poses=POSES)
    for drop in (False, True):
        with pytest.raises(LogError, match="has no number in left"):
            list(read_logs(path, mapped, ROBOT, drop_bad_rows=drop))


def test_log_of_encoders_and_poses_has_no_commands(tmp_path):
    commands, poses = drive(60)
    ways = np.concatenate([np.zeros((1, 2)), np.cumsum(commands * SPEED * STEP_S, 0)])
    table = np.column_stack([STEP_S * np.arange(61), ways, poses])
    path = write(tmp_path / "log.csv", table)
    mapped = LogMap(wheels={**COMMANDS, "unit": "m"}, poses=POSES)
    (log,) = read_logs(path, mapped, ROBOT)
    assert not log.has_commands
    assert any("no commands" in note for note in log.notes)
    assert log.wheels == pytest.approx(ways)
    assert log.poses == pytest.approx(poses)
    assert log.commands == pytest.approx(commands)  # as shares of full speed
    trial = trial_of(log, mapped)
    assert trial.wheels == pytest.approx(ways)
    assert trial.poses == pytest.approx(poses)
    report = import_log(path, tmp_path / "trials.jsonl", mapped.model_copy(update={"robot": "pioneer"}))
    assert report.observe == "wheels, poses"


def test_a_column_splits_trials(tmp_path):
    commands, poses = drive(60)
    table = rows(commands, poses)
    both = np.concatenate([np.column_stack([table, np.full(61, k)]) for k in (3, 7)])
    path = write(tmp_path / "log.csv", both, "t,left,right,x,y,heading,episode")
    logs = list(read_logs(path, log_map(trial="episode"), ROBOT))
    assert [log.name for log in logs] == ["3", "7"]
    for log in logs:
        assert log.poses == pytest.approx(poses)
    with pytest.raises(LogError, match=r"row 62 of \[commands\] goes back in time, from 6 to 0 s"):
        read(path)


BAD_ROWS = {
    "nan": (lambda table: table[10].__setitem__(1, np.nan), "row 11 of [commands] has no number in left"),
    "time": (lambda table: table[10].__setitem__(0, np.nan), "row 11 of [commands] has no time"),
    "twice": (lambda table: table.__setitem__(10, table[9]), "row 11 of [commands] repeats the time 0.9"),
    "back": (
        lambda table: table[10].__setitem__(0, 0.2),
        "row 11 of [commands] goes back in time, from 0.9 to 0.2 s",
    ),
}


def test_bad_rows_have_one_message_and_can_be_dropped(made):
    path, commands, _ = made
    good = np.genfromtxt(path, delimiter=",", skip_header=1)
    for name, (spoil, message) in BAD_ROWS.items():
        table = good.copy()
        spoil(table)
        write(path, table)
        with pytest.raises(LogError) as error:
            read(path)
        assert message in str(error.value), name
        assert "--drop-bad-rows" in str(error.value)
        (log,) = read_logs(path, log_map(), ROBOT, drop_bad_rows=True)
        assert np.abs(log.commands - commands)[20:].max() < 1e-9, name
        assert any("had mistakes and were left out" in note for note in log.notes), name


WRONG_MAPS = {
    'commands = {time = "t", left = "left"}': "commands: expected left and right, or forward and turn",
    'commands = {time = "t", left = "left", right = "right", unit = "furlong/s"}': "commands.unit is 'furlong/s'",
    'commands = {time = "t", left = "left", right = "right", unit = "rpm"}': "give wheel_diameter_mm",
    'commands = {left = "left", right = "right"}': "names no column of the time",
    'commands = {time = "t", left = "left", right = "wrong"}': "has no column wrong",
    'poses = {time = "t", x = "x", y = "y"}': "poses alone do not show",
    'commands = {time = "t", left = "left", right = "right", time_unit = "h"}': "commands.time_unit is 'h'",
    'commands = {time = "t", left = "left", right = "right", left_sign = 2}': "expected 1 or -1, got 2",
    'comands = {time = "t"}': "Did you mean 'commands'?",
    "commands = [": "it is not TOML",
}


def test_wrong_mappings_have_one_message(made, tmp_path):
    path, _, _ = made
    for text, message in WRONG_MAPS.items():
        (tmp_path / "map.toml").write_text(text, "utf-8")
        with pytest.raises(LogError) as error:
            list(read_logs(path, load_log_map(tmp_path / "map.toml"), ROBOT))
        assert message in str(error.value), text


def test_irregular_commands_need_a_step(made):
    path, _, _ = made
    table = np.genfromtxt(path, delimiter=",", skip_header=1)
    table[:, 0] = np.cumsum(np.where(np.arange(61) % 2, 0.02, 0.18))
    write(path, table)
    with pytest.raises(LogError, match=r"comes at irregular times, mostly 0.02 to 0.18 s apart"):
        read(path)
    assert len(read(path, step_s=0.2).commands) == 30


def test_a_trial_too_long_for_memory_is_refused(made):
    path, _, _ = made
    with pytest.raises(LogError, match=r"steps of 1e-06 s, expected at most 2,000,000"):
        read(path, step_s=1e-6)


def test_names_of_columns_give_the_mapping(tmp_path):
    names = {
        "time_ms,vl_mm_s,vr_mm_s,x_mm,y_mm,theta_deg": {
            "commands": {"time": "time_ms", "time_unit": "ms", "left": "vl_mm_s", "right": "vr_mm_s", "unit": "mm/s"},
            "poses": {
                "time": "time_ms", "time_unit": "ms", "x": "x_mm", "y": "y_mm", "unit": "mm", "heading": "theta_deg",
                "heading_unit": "deg",
            },
        },
        "timestamp,leftSpeed,rightSpeed,encoder_left,encoder_right,gt_x,gt_y,odom_x,odom_y": {
            "commands": {"time": "timestamp", "left": "leftSpeed", "right": "rightSpeed"},
            "wheels": {"time": "timestamp", "left": "encoder_left", "right": "encoder_right", "unit": "ticks"},
            "poses": {"time": "timestamp", "x": "gt_x", "y": "gt_y"},
        },
        "t,v,omega,x,y,yaw,ir0,ir1,ir2": {
            "commands": {"time": "t", "forward": "v", "turn": "omega"},
            "poses": {"time": "t", "x": "x", "y": "y", "heading": "yaw"},
            "readings": {"time": "t", "sensors": ["ir0", "ir1", "ir2"]},
        },
    }  # fmt: skip
    for header, expected in names.items():
        path = write(tmp_path / "log.csv", np.zeros((3, header.count(",") + 1)), header)
        assert guess_log_map(path) == LogMap(**expected), header
        assert LogMap(**expected).to_toml()
    with pytest.raises(LogError, match="do not say which are the wheels: t, a, b"):
        guess_log_map(write(tmp_path / "log.csv", np.zeros((3, 3)), "t,a,b"))


def test_mapping_comes_back_from_its_file(tmp_path):
    mapped = log_map(step_s=0.2, robot="pioneer", text={"separator": "tab"})
    (tmp_path / "map.toml").write_text(mapped.to_toml(), "utf-8")
    assert load_log_map(tmp_path / "map.toml") == mapped


def lerobot(folder, commands, poses):
    (folder / "meta").mkdir(parents=True)
    (folder / "data/chunk-000").mkdir(parents=True)
    features = {"action": {"dtype": "float32", "shape": [2], "names": ["left", "right"]}}
    (folder / "meta/info.json").write_text(json.dumps({"fps": 10, "features": features}), "utf-8")
    for episode in range(2):
        n = len(commands)
        frame = pl.DataFrame(
            {
                "action": (commands * SPEED).tolist(),
                "observation.state": pl.Series(poses[:-1].tolist(), dtype=pl.Array(pl.Float64, 3)),
                "timestamp": STEP_S * np.arange(n),
                "frame_index": np.arange(n),
                "episode_index": np.full(n, episode),
            }
        )
        frame.write_parquet(folder / f"data/chunk-000/episode_{episode:06d}.parquet")
    return folder


def test_episodes_of_a_lerobot_dataset_are_trials(tmp_path):
    commands, poses = drive(60)
    folder = lerobot(tmp_path / "set", commands, poses)
    guessed = guess_log_map(folder)
    assert guessed.commands.columns() == ["action.left", "action.right"]
    state = {
        "time": "timestamp",
        "x": "observation.state[0]",
        "y": "observation.state[1]",
        "heading": "observation.state[2]",
    }
    logs = list(
        read_logs(folder, guessed.model_copy(update={"poses": type(log_map().poses)(**state)}), ROBOT)
    )
    assert [log.name for log in logs] == ["0", "1"]
    assert logs[1].commands == pytest.approx(commands[:-1], abs=1e-6)
    assert logs[1].poses == pytest.approx(poses[:-1])
    data = folder / "data/chunk-000/episode_000001.parquet"
    data.write_bytes(data.read_bytes()[:-100])
    with pytest.raises(LogError, match=r"episode_000001.parquet cannot be read"):
        list(read_logs(folder, guessed, ROBOT))
    (folder / "meta/info.json").write_text("{}", "utf-8")
    with pytest.raises(LogError, match=r"info.json is not as LeRobot writes it"):
        guess_log_map(folder)
