"""The robot by Fast DDS, against a peer by Cyclone DDS that does not use the driver."""

import math
import time

import numpy as np
import pytest

from realitygap.emulator import connect_witness
from realitygap.world import Pose, paper_arena

from .fast_dds import wait_until

pytest.importorskip("cyclonedds", reason="needs the Python package cyclonedds")

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.idl._support import Endianness

from .cyclone import (
    Bool,
    Header,
    LaserScan,
    Odometry,
    PoseStamped,
    Range,
    RangeWithVariance,
    Time,
    Twist,
    TwistStamped,
    next_message,
    seconds,
    twist,
    valid,
)

pytestmark = pytest.mark.slow

WIDTH, HEIGHT = paper_arena().walls[1][2:]
PLACE = Pose(0.4, 0.25, 0.3)
TYPES = {
    "odom": "nav_msgs::msg::dds_::Odometry_",
    "scan": "sensor_msgs::msg::dds_::LaserScan_",
    "range_0": "sensor_msgs::msg::dds_::Range_",
    "bumper": "std_msgs::msg::dds_::Bool_",
}


def has_moved(robot):
    return len(robot.path()) > 1


def rests(robot):
    return has_moved(robot) and robot.motors() == (0.0, 0.0)


def drive(robot, writer, command):
    """Send a command once and wait until it has ended."""
    writer.write(command)
    wait_until(lambda: rests(robot))


def driven(path):
    """Return duration [s], distance [m], and turn [rad] of a path."""
    _, x, y, heading = path.T
    return path[-1, 0] - path[0, 0], np.hypot(np.diff(x), np.diff(y)).sum(), heading[-1] - heading[0]


def distance_in_room(x, y, angle):
    """Return the distance to the wall of a rectangular room in a direction [m]."""
    c, s = math.cos(angle), math.sin(angle)
    across = (WIDTH - x) / c if c > 0 else -x / c
    up = (HEIGHT - y) / s if s > 0 else -y / s
    return min(across, up)


def heading_of(orientation):
    return 2 * math.atan2(orientation.z, orientation.w)


@pytest.mark.parametrize("byte_order", ["little", "big"])
def test_twist_moves_the_robot_and_odometry_reports_the_true_motion(start_robot, peer, byte_order):
    robot = start_robot(start=tuple(PLACE), byte_order=byte_order, rate_pose=50)
    odometry = peer.reader("rt/odom", Odometry, is_reliable=True, depth=1000)
    truth = peer.reader("rt/pose", PoseStamped)
    writer = peer.writer("rt/cmd_vel", Twist)
    robot.wait_matched("odom", "pose", "cmd_vel")
    drive(robot, writer, in_order(byte_order, twist(0.1, 0.5)))
    assert robot.ask("commands") == {"twist": 1, "stamped": 0, "refused": 0, "linear": 0.1, "angular": 0.5}
    _, distance, turn = driven(robot.path())
    assert (distance, turn) == pytest.approx((0.05, 0.25), rel=1e-4)

    fastest = [sample for sample in valid(odometry) if sample.twist.twist.linear.x > 0]
    assert max(sample.twist.twist.linear.x for sample in fastest) == pytest.approx(0.1, rel=1e-6)
    assert max(sample.twist.twist.angular.z for sample in fastest) == pytest.approx(0.5, rel=1e-6)
    last = next_message(odometry, time.time())
    assert (last.header.frame_id, last.child_frame_id) == ("odom", "base_link")
    c, s = math.cos(PLACE.heading), math.sin(PLACE.heading)
    x, y = last.pose.pose.position.x, last.pose.pose.position.y
    assert heading_of(last.pose.pose.orientation) == pytest.approx(turn)
    assert robot.pose().x == pytest.approx(PLACE.x + c * x - s * y, abs=1e-4)
    assert robot.pose().y == pytest.approx(PLACE.y + s * x + c * y, abs=1e-4)
    pose = next_message(truth, time.time()).pose
    seen = (pose.position.x, pose.position.y, heading_of(pose.orientation))
    assert seen == pytest.approx(tuple(robot.pose()))


def in_order(byte_order, message):
    """Return a message whose bytes Cyclone DDS writes in an order."""
    if byte_order == "big":
        message.serialize = lambda use_version_2=None: type(message).serialize(
            message, endianness=Endianness.Big, use_version_2=use_version_2
        )
    assert message.serialize()[:4] == bytes([0, byte_order == "little", 0, 0])
    return message


@pytest.mark.parametrize("byte_order", ["little", "big"])
def test_scan_and_ranges_are_the_distances_to_the_walls(start_robot, peer, byte_order):
    mounts = [(0.05, 0.0, 0.0), (-0.02, 0.04, 1.0)]
    robot = start_robot(start=tuple(PLACE), range=mounts, range_limits=(0.005, 0.5), byte_order=byte_order)
    scan = next_message(peer.reader("rt/scan", LaserScan))
    angles = [PLACE.heading + scan.angle_min + k * scan.angle_increment for k in range(360)]
    assert scan.ranges == pytest.approx(
        [distance_in_room(PLACE.x, PLACE.y, angle) for angle in angles], abs=1e-4
    )
    assert (scan.range_min, scan.range_max) == pytest.approx((0.05, 3.5))
    for k, (ahead, left, angle) in enumerate(mounts):
        c, s = math.cos(PLACE.heading), math.sin(PLACE.heading)
        x, y = PLACE.x + c * ahead - s * left, PLACE.y + s * ahead + c * left
        cone = [distance_in_room(x, y, PLACE.heading + angle + turn) for turn in np.linspace(-0.05, 0.05, 5)]
        range_ = next_message(peer.reader(f"rt/range_{k}", Range))
        assert range_.range == (pytest.approx(min(cone), abs=1e-5) if min(cone) < 0.5 else math.inf)
        assert (range_.field_of_view, range_.min_range, range_.max_range) == pytest.approx((0.1, 0.005, 0.5))
    assert robot.ask("readings nan") is None
    wait_until(lambda: math.isnan(next_message(peer.reader("rt/range_0", Range)).range))


def test_range_of_new_ros_has_a_variance(start_robot, peer):
    start_robot(range=[(0, 0, 0)], variance=0.25)
    assert next_message(peer.reader("rt/range_0", RangeWithVariance)).variance == 0.25


def test_discovery_shows_topics_and_types(start_robot, peer):
    start_robot(namespace="/robot1", range=[(0, 0, 0)], renamed="scan", stamped_topic="cmd_vel_stamped")
    writers = BuiltinDataReader(peer.participant, BuiltinTopicDcpsPublication)
    readers = BuiltinDataReader(peer.participant, BuiltinTopicDcpsSubscription)
    expected = {f"rt/robot1/{name}": kind for name, kind in TYPES.items()}
    expected["rt/robot1/scan"] = "other_msgs::msg::dds_::Other_"
    expected["rt/robot1/cmd_vel"] = "geometry_msgs::msg::dds_::Twist_"
    expected["rt/robot1/cmd_vel_stamped"] = "geometry_msgs::msg::dds_::TwistStamped_"
    types = {}

    def is_complete():
        samples = [sample for reader in (writers, readers) for sample in valid(reader)]
        types.update(
            {sample.topic_name: sample.type_name for sample in samples if sample.topic_name[:3] == "rt/"}
        )
        return len(types) >= len(expected)

    wait_until(is_complete)
    assert types == expected


def test_command_lasts_for_the_timeout(start_robot, peer):
    robot = start_robot(timeout=0.2)
    drive(robot, peer.writer("rt/cmd_vel", Twist), twist(0.1, 0.0))
    assert driven(robot.path())[1] == pytest.approx(0.02, rel=1e-6)


def test_without_timeout_the_last_command_stays_until_the_robot_is_placed(start_robot, peer):
    robot = start_robot(timeout=0, gains=(1.0, 0.5), max_wheel=0.1, lag=0.05)
    peer.writer("rt/cmd_vel", Twist).write(twist(0.02, 0.0))
    wait_until(lambda: robot.motors() == pytest.approx((0.02, 0.01)))
    wait_until(lambda: robot.path()[-1, 0] - robot.path()[1, 0] > 0.6)
    robot.place(PLACE, 1)
    assert robot.motors() == (0.0, 0.0)
    assert robot.pose() == PLACE
    peer.writer("rt/cmd_vel", Twist).write(twist(5.0, 0.0))
    wait_until(lambda: robot.motors() == pytest.approx((0.1, 0.05)))


@pytest.mark.parametrize("restarts", [0, 1])
def test_odometry_has_its_own_scale_and_restarts_as_chosen(start_robot, peer, restarts):
    robot = start_robot(odometry_restarts=restarts, odometry_scale=(1.1, 1.1))
    drive(robot, peer.writer("rt/cmd_vel", Twist), twist(0.1, 0.0))
    odometry = peer.reader("rt/odom", Odometry, is_reliable=True)
    assert driven(robot.path())[1] == pytest.approx(0.05)
    assert next_message(odometry, time.time()).pose.pose.position.x == pytest.approx(0.055)
    robot.place(PLACE)
    assert next_message(odometry, time.time()).pose.pose.position.x == pytest.approx(0 if restarts else 0.055)


def test_noise_of_a_seed_is_repeated(start_robot, peer):
    robot = start_robot(timeout=0.3, wheel_noise=0.02, odometry_noise=0.05)
    writer = peer.writer("rt/cmd_vel", Twist)
    ends = []
    for seed in (1, 2, 1):
        robot.place(PLACE, seed)
        drive(robot, writer, twist(0.2, 0.0))
        ends.append(tuple(robot.pose()))
    assert ends[0] == pytest.approx(ends[2], abs=1e-9)
    assert ends[0] != pytest.approx(ends[1], abs=1e-4)


def test_stamped_commands_with_a_wrong_clock_are_refused(start_robot, peer):
    robot = start_robot(twist_topic="", stamped_topic="cmd_vel", max_age=30)
    writer = peer.writer("rt/cmd_vel", TwistStamped)

    def send(stamp):
        header = Header(Time(int(stamp), 0), "base_link")
        writer.write(TwistStamped(header, twist(0.1, 0.0)))

    send(time.time() - 3600)
    wait_until(lambda: robot.ask("commands")["refused"] == 1)
    assert robot.motors() == (0.0, 0.0)
    send(time.time())
    wait_until(lambda: has_moved(robot))
    assert robot.ask("commands")["stamped"] == 2


def test_wall_stops_the_robot_and_the_bumper_reports_it(start_robot, peer):
    robot = start_robot(start=(0.9, 0.3, 0.0), timeout=0, radius=0.05)
    bumper = peer.reader("rt/bumper", Bool)
    robot.wait_matched("bumper")
    peer.writer("rt/cmd_vel", Twist).write(twist(0.2, 0.0))
    wait_until(lambda: any(sample.data for sample in valid(bumper)))
    assert robot.pose().x == pytest.approx(WIDTH - 0.05, abs=0.005)
    wait_until(lambda: robot.now() - robot.path()[0, 0] > 1)
    assert robot.pose().x == pytest.approx(WIDTH - 0.05, abs=0.005)


def test_reliable_reader_gets_nothing_from_a_best_effort_topic(start_robot, peer):
    robot = start_robot(reliable="cmd_vel")
    refused = peer.reader("rt/odom", Odometry, is_reliable=True)
    wait_until(lambda: robot.ask("endpoints")["odom"] == [0, 1])
    wait_until(lambda: refused.get_requested_incompatible_qos_status().total_count == 1)
    next_message(peer.reader("rt/odom", Odometry))
    assert valid(refused) == []


def test_odometry_comes_1000_times_a_second(start_robot, peer):
    robot = start_robot(rate_odom=1000)
    odometry = peer.reader("rt/odom", Odometry, is_reliable=True, depth=5000)
    robot.wait_matched("odom")
    stamps = []

    def has_enough():
        stamps.extend(seconds(sample.header) for sample in valid(odometry))
        return len(stamps) > 1000

    wait_until(has_enough)
    assert np.median(np.diff(stamps)) == pytest.approx(0.001, abs=1e-5)


def test_scan_changes_its_length_up_to_10_megabytes(start_robot, peer):
    robot = start_robot(reliable="scan", rate_scan=2)
    scans = peer.reader("rt/scan", LaserScan, is_reliable=True)
    for n in (1, 7, 2_621_440):
        robot.ask(f"scan_rays {n}")
        wait_until(lambda: any(len(sample.ranges) == n for sample in valid(scans)))  # noqa: B023


def test_clock_jumps_topics_stop_and_the_robot_leaves_and_returns(start_robot, peer):
    robot = start_robot()
    odometry = peer.reader("rt/odom", Odometry, is_reliable=True, depth=100)
    robot.ask("shift 1000")
    assert 900 < seconds(next_message(odometry, time.time() + 500).header) - time.time() < 1100
    robot.ask("mute odom")
    until = robot.now()
    robot.ask("shift 5000")
    wait_until(lambda: robot.now() > until + 0.2)
    assert not [sample for sample in valid(odometry) if seconds(sample.header) > time.time() + 4000]
    robot.ask("unmute odom")
    next_message(odometry, time.time() + 4000)
    robot.ask("leave")
    wait_until(lambda: not odometry.get_matched_publications())
    assert robot.ask("endpoints") == {}
    robot.ask("return")
    wait_until(lambda: bool(odometry.get_matched_publications()))
    next_message(odometry, time.time() + 4000)


def test_two_robots_in_two_namespaces_drive_apart(start_robot, peer):
    robots = [start_robot(namespace=f"/robot{k}") for k in (1, 2)]
    drive(robots[0], peer.writer("rt/robot1/cmd_vel", Twist), twist(0.1, 0.0))
    assert [has_moved(robot) for robot in robots] == [True, False]


def test_it_is_a_witness_for_other_programs(start_robot, peer):
    robot = start_robot()
    witness = connect_witness(robot.serve())
    with witness:
        witness.place(PLACE, 3)
        drive(robot, peer.writer("rt/cmd_vel", Twist), twist(0.2, 0.0))
        assert witness.path() == pytest.approx(robot.path())
        assert witness.pose() == robot.pose()
        assert witness.arena() == paper_arena()
        assert witness.identity() == robot.identity()
        assert witness.cells() == robot.cells()
        assert len(witness.cells()) == 2
        assert witness.cells_at([0.0]) == witness.cells()[:1]
        assert not witness.waits


@pytest.mark.parametrize("options", [{"rubbish": 1}, {"gains": (1.0,)}, {"step": 0}])
def test_wrong_option_is_an_error(start_robot, options):
    with pytest.raises(ValueError, match=next(iter(options))):
        start_robot(**options)
