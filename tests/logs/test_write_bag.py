"""Trials survive the trip through bags of ROS 2 and MCAP files, in standard messages."""

from dataclasses import replace

import numpy as np
import pytest

from realitygap.errors import LogError, RecordError
from realitygap.evolution import Population
from realitygap.logs import guess_log_map, import_log, mapping_of, write_bag
from realitygap.records import ObservationsHead, ResultsFolder, TrialRecord, read_observations
from realitygap.world import load_arena, load_robot, paper_arena

ROBOT = "pioneer"
HEAD = ObservationsHead("twin:worn", "TWIN", ROBOT, paper_arena().to_dict(), 0.2, "track")


def trial(n=12, **changes):
    """A trial in which all is observed."""
    random = np.random.default_rng(3)
    robot = load_robot(ROBOT)
    poses = np.array([0.2, 0.2, 6.0]) + np.cumsum(random.uniform(-0.02, 0.05, (n + 1, 3)), axis=0)
    made = TrialRecord(
        start=tuple(poses[0].tolist()),
        step_s=0.2,
        commands=random.uniform(-0.5, 0.5, (n, 2)),
        readings=random.uniform(0, 1, (n, len(robot.range))),
        stalled=np.zeros(n, bool),
        cells=(1, 2),
        wheels=np.cumsum(random.uniform(0, 0.04, (n + 1, 2)), axis=0) * (np.arange(n + 1) > 0)[:, None],
        poses=poses,
        number=7,
        last_readings=random.uniform(0, 1, len(robot.range)),
    )
    return replace(made, **changes)


def back(report, tmp_path):
    """The trial as `realitygap import` reads it."""
    log_map, origin = mapping_of(report.bag)
    assert origin == str(report.mapping)
    found = import_log(report.bag, tmp_path / "again.jsonl", log_map)
    assert found.mistakes == () or {each.kind for each in found.mistakes}  # the motion is random
    read = read_observations(tmp_path / "again.jsonl")
    (again,) = read.trials
    return again, read.head


@pytest.mark.parametrize("name", ["trial.mcap", "trial"])
def test_a_trial_comes_back(tmp_path, name):
    made = trial()
    report = write_bag(made, HEAD, tmp_path / name)
    n = len(load_robot(ROBOT).range)
    assert report.n_messages == {"/cmd_vel": 13, "/odom": 13, "/joint_states": 13} | {
        f"/range_{k}": 13 for k in range(n)
    }
    again, head = back(report, tmp_path)
    assert (head.label, head.robot, head.arena["name"]) == ("TWIN", ROBOT, "paper")
    assert again.step_s == pytest.approx(0.2)
    np.testing.assert_allclose(again.commands, made.commands, atol=1e-7)
    np.testing.assert_allclose(again.poses[:, :2], made.poses[:, :2], atol=1e-7)
    turned = again.poses[:, 2] - made.poses[:, 2]
    np.testing.assert_allclose(turned, np.rint(turned / (2 * np.pi)) * 2 * np.pi, atol=1e-7)
    np.testing.assert_allclose(again.wheels, made.wheels, atol=1e-7)
    np.testing.assert_allclose(again.readings, made.readings, atol=1e-6)


def test_messages_are_those_of_ros_with_their_units(tmp_path):
    from rosbags.highlevel import AnyReader

    made = trial(
        2,
        commands=np.array([[0.5, 0.0], [0.0, 0.25]]),
        poses=np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0.3]]),
    )
    write_bag(made, HEAD, tmp_path / "bag", wheel_diameter_mm=200.0)
    robot = load_robot(ROBOT)
    with AnyReader([tmp_path / "bag"]) as reader:
        seen = {}
        for connection, stamp, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
            seen.setdefault(connection.topic, []).append(message)
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
    assert kinds["/cmd_vel"] == "geometry_msgs/msg/TwistStamped"
    assert kinds["/odom"] == "nav_msgs/msg/Odometry"
    assert kinds["/joint_states"] == "sensor_msgs/msg/JointState"
    assert kinds["/range_0"] == "sensor_msgs/msg/Range"
    speeds = [(each.twist.linear.x, each.twist.angular.z) for each in seen["/cmd_vel"]]
    speed, track = robot.drive.speed, robot.drive.track
    assert speeds == [(0.5 * speed, 0.0), (0.0, pytest.approx(0.5 * speed / track)), (0.0, 0.0)]
    odom = seen["/odom"]
    assert (odom[0].header.frame_id, odom[0].child_frame_id) == ("map", "base_link")
    assert odom[1].twist.twist.linear.x == pytest.approx(0.5)
    assert odom[2].twist.twist.angular.z == pytest.approx(1.5)
    assert odom[2].pose.pose.orientation.w == pytest.approx(np.cos(0.15))
    joints = seen["/joint_states"]
    assert joints[1].name == ["left_wheel_joint", "right_wheel_joint"]
    np.testing.assert_allclose(joints[1].position, made.wheels[1] / 0.1)
    nearest = seen["/range_0"][0]
    assert nearest.range == pytest.approx(nearest.max_range * (1 - made.readings[0, 0]), rel=1e-6)


def test_a_bag_without_its_mapping_is_guessed(tmp_path):
    made = trial()
    report = write_bag(made, HEAD, tmp_path / "trial.mcap")
    report.mapping.unlink()
    guessed = guess_log_map(report.bag)
    assert guessed.commands.columns() == ["/cmd_vel/twist/linear/x", "/cmd_vel/twist/angular/z"]
    assert guessed.readings.sensors == tuple(f"/range_{k}/range" for k in range(made.readings.shape[1]))
    assert guessed.readings.inverted
    log_map = guessed.model_copy(update={"wheels": None, "robot": ROBOT})
    import_log(report.bag, tmp_path / "again.jsonl", log_map)
    (again,) = read_observations(tmp_path / "again.jsonl").trials
    np.testing.assert_allclose(again.readings, made.readings, atol=1e-6)


def test_observations_that_were_not_made_have_no_topic(tmp_path):
    made = trial(wheels=np.empty((0, 2)), poses=np.empty((0, 3)), last_readings=np.empty(0))
    report = write_bag(made, HEAD, tmp_path / "trial.mcap")
    assert set(report.n_messages) == {"/cmd_vel"} | {f"/range_{k}" for k in range(made.readings.shape[1])}
    assert report.n_messages["/range_0"] == 12


def test_the_arena_and_the_controller_lie_next_to_it(tmp_path):
    genome = Population(3, 2, seed=1).ask()[0]
    arena = replace(load_arena("paper"), name="mine")
    head = replace(HEAD, arena=arena.to_dict())
    report = write_bag(trial(genome=genome.to_json()), head, tmp_path / "one" / "trial.mcap")
    assert {path.name for path in report.bag.parent.iterdir()} == {
        "trial.mcap", "trial.map.toml", "trial.arena.toml", "trial.controller.json"
    }  # fmt: skip
    report.bag.parent.rename(tmp_path / "two")
    moved = replace(report, bag=tmp_path / "two/trial.mcap", mapping=tmp_path / "two/trial.map.toml")
    again, read = back(moved, tmp_path)
    assert again.genome == genome.to_json()
    assert read.arena["name"] == "mine"


def test_times_of_a_real_robot_are_kept(tmp_path):
    times = np.cumsum([0.0, *[0.2] * 5, 0.31, *[0.2] * 6])
    report = write_bag(trial(), HEAD, tmp_path / "trial", times=times)
    log_map, _ = mapping_of(report.bag)
    found = import_log(report.bag, tmp_path / "again.jsonl", log_map)
    assert found.n_steps == 12


def test_wrong_input_for_a_bag_gets_one_message(tmp_path):
    write_bag(trial(), HEAD, tmp_path / "trial.mcap")
    with pytest.raises(LogError, match=r"trial\.mcap exists already"):
        write_bag(trial(), HEAD, tmp_path / "trial.mcap")
    with pytest.raises(LogError, match=r"b\.txt ends in \.txt, expected a file that ends in \.mcap"):
        write_bag(trial(), HEAD, tmp_path / "b.txt")
    with pytest.raises(LogError, match="Trial 7 has no command"):
        write_bag(trial(commands=np.empty((0, 2))), HEAD, tmp_path / "a.mcap")
    with pytest.raises(LogError, match=r"Trial 7 has 5 range sensors, and the robot .* has"):
        write_bag(trial(readings=np.zeros((12, 5))), HEAD, tmp_path / "a.mcap")
    with pytest.raises(ValueError, match="wheel_diameter_mm is 0, expected a length above 0"):
        write_bag(trial(), HEAD, tmp_path / "a.mcap", wheel_diameter_mm=0)
    folder = ResultsFolder.create(tmp_path / "results", {"conditions": ["a"]})
    with pytest.raises(RecordError):
        write_bag(trial(), HEAD, folder.path / "trials" / "a.mcap")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["results", "trial.map.toml", "trial.mcap"]
