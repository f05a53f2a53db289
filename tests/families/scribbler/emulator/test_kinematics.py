"""Motion against closed forms, and independence of how time is cut into pieces."""

import math

import numpy as np
import pytest

from realitygap.families.scribbler.emulator import Emulator
from realitygap.world import Arena, Grid, Pose

from .wire import OPEN_FIELD, ask, long, make, packet, say, signed, word

COUNT = 0.00025
SPACING = 955 * 0.0005 / math.pi


def settled(robot, right, left, seconds):
    """Poses before and after driving at a steady speed for a time."""
    say(robot, packet(109, right, left), 1.0)
    before = robot.pose
    robot.advance(seconds)
    return before, robot.pose


@pytest.fixture
def robot():
    return make("s2", arena=OPEN_FIELD)


@pytest.mark.parametrize(
    ("byte", "step"), [(200, 12), (150, 6), (107, 2), (101, 2), (116, 2), (124, 3), (0, 12), (228, 15)]
)
def test_speed_comes_in_steps_of_12_5_mm_a_second(robot, byte, step):
    before, after = settled(robot, byte, byte, 2.0)
    sign = 1 if byte > 100 else -1
    assert after.x - before.x == pytest.approx(sign * 2.0 * step * 0.0125, rel=1e-9)
    assert after.y == pytest.approx(0.0, abs=1e-12)


def test_full_turn_on_the_spot_is_112_degrees_a_second(robot):
    before, after = settled(robot, 200, 0, 1.0)
    assert math.degrees(after.heading - before.heading) == pytest.approx(112.7, rel=0.006)
    assert math.hypot(after.x - before.x, after.y - before.y) < 1e-12


def test_the_other_wheel_follows_in_proportion_along_an_arc(robot):
    before, after = settled(robot, 200, 150, 2.0)
    right, left = 0.150, 0.075
    radius = SPACING / 2 * (right + left) / (right - left)
    turned = (right - left) / SPACING * 2.0
    assert after.heading - before.heading == pytest.approx(turned, rel=1e-9)
    chord = math.hypot(after.x - before.x, after.y - before.y)
    assert chord == pytest.approx(2 * radius * math.sin(turned / 2), rel=1e-9)


def test_full_speed_is_reached_within_a_quarter_of_a_second_and_stop_is_at_once(robot):
    robot.receive(packet(109, 200, 200))
    robot.advance(0.01)
    speeds = []
    for _ in range(15):
        robot.advance(0.02)
        speeds.append(robot.wheel_speeds()[0] / 0.0125)
    assert speeds == pytest.approx([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 12, 12, 12], abs=1.01)
    assert speeds == sorted(speeds)
    say(robot, packet(108), 0.02)
    at = robot.pose
    robot.advance(1.0)
    assert robot.pose == at


def test_encoders_count_a_quarter_of_a_millimeter_with_their_sign(robot):
    say(robot, packet(109, 0, 200), 2.0)
    say(robot, packet(108))
    answer = ask(robot, 171, 1)
    left, right = signed(answer[:4]), signed(answer[4:])
    turned = -robot.pose.heading
    assert left == pytest.approx(turned * SPACING / 2 / COUNT, abs=2)
    assert right == -left


def test_an_s1_drives_open_loop_in_proportion():
    robot = make("s1", arena=OPEN_FIELD)
    before, after = settled(robot, 150, 150, 2.0)
    assert after.x - before.x == pytest.approx(0.15, rel=1e-9)
    before, after = settled(robot, 150, 50, 1.0)
    assert after.heading - before.heading == pytest.approx(0.15 / 0.1463, rel=1e-9)


@pytest.mark.parametrize(
    ("place", "right", "left", "turn"), [(0, 200, 200, 1), (1, 140, 140, 1), (2, 60, 60, 1), (3, 0, 0, 1)]
)
def test_the_trim_of_an_s1_slows_one_wheel(place, right, left, turn):
    robot = make("s1", arena=OPEN_FIELD)
    ask(robot, 96, place, 140)
    before, after = settled(robot, right, left, 2.0)
    # the left wheel is slowed ahead, the right one back: either way it turns to the left when driving so
    assert (after.heading - before.heading) * turn > 0.1
    ask(robot, 96, place, 127)
    before, after = settled(robot, right, left, 2.0)
    assert after.heading == before.heading


def test_a_blocked_robot_stays_and_says_so():
    robot = make("s2", "none")
    say(robot, packet(109, 200, 200), 30.0)
    at = robot.pose
    assert at.x == pytest.approx(1.0668 - 0.089, abs=0.002)
    robot.advance(1.0)
    assert robot.pose == at
    assert ask(robot, 79) == b"\x01"
    say(robot, packet(109, 0, 0), 1.0)
    assert ask(robot, 79) == b"\x00"
    assert robot.pose.x < at.x
    say(robot, packet(108))
    assert ask(robot, 65)[10] == 0


def test_the_box_turns_freely_only_where_its_corners_do():
    walls = (
        (-1.0, 0.1, 1.0, 0.1),
    )  # 10 cm to the side: less than from the pen to a corner, more than to the side
    arena = Arena("wall", walls, Grid(-1.0, -1.0, 0.5, 4, 4), Pose(0.0, 0.0, 0.0))
    robot = make("s2", arena=arena)
    say(robot, packet(109, 200, 0), 5.0)
    assert 0 < robot.pose.heading < math.pi / 2
    assert ask(robot, 79) == b"\x01"


# motions by distance


def test_move_by_faces_the_target_and_drives_there(robot):
    ask(robot, 162, 5, *word(100), *word(100), seconds=10.0)
    x, y, heading = robot.pose
    assert (x, y) == pytest.approx((0.1, 0.1), abs=5e-4)
    assert heading == pytest.approx(math.pi / 4, abs=5e-3)
    answer = ask(robot, 165)
    assert (signed(answer[:4]), signed(answer[4:])) == (100, 100)


def test_position_is_the_target_at_once_and_set_motors_does_not_change_it(robot):
    robot.receive(packet(162, 5, *word(500), *word(0)))
    robot.advance(0.1)
    robot.transmit()
    answer = ask(robot, 165, seconds=0.1)
    assert signed(answer[:4]) == 500
    assert robot.pose.x < 0.1
    ask(robot, 109, 200, 200)
    assert signed(ask(robot, 165)[:4]) == 500


@pytest.mark.parametrize("unit", [0, 1])
def test_units_are_half_millimeters_or_millimeters(robot, unit):
    ask(robot, 162, 2 + unit, *word(200), *word(0), seconds=10.0)
    assert robot.pose.x == pytest.approx(0.1 * (1 + unit), abs=5e-4)


def test_turns_take_the_shorter_way_and_now_does_not(robot):
    ask(robot, 164, 5, *word(270), seconds=10.0)
    assert math.degrees(robot.pose.heading) == pytest.approx(-90, abs=0.3)
    ask(robot, 164, 3, *word(90), seconds=10.0)
    assert math.degrees(robot.pose.heading) == pytest.approx(90, abs=0.6) or math.degrees(
        robot.pose.heading
    ) == pytest.approx(-270, abs=0.6)
    before = robot.pose.heading
    ask(robot, 164, 13, *word(270), seconds=10.0)
    assert math.degrees(robot.pose.heading - before) == pytest.approx(270, abs=0.5)


def test_a_turn_in_units_is_a_955th_of_a_circle(robot):
    ask(robot, 164, 12, *word(955), seconds=20.0)
    assert robot.pose.heading == pytest.approx(2 * math.pi, abs=5e-3)


def test_arc_by_angle_is_an_arc(robot):
    ask(robot, 163, 13, *word(90), *word(0), *word(200), seconds=20.0)
    x, y, heading = robot.pose
    assert (x, y) == pytest.approx((0.2, 0.2), abs=2e-3)
    assert heading == pytest.approx(math.pi / 2, abs=5e-3)
    answer = ask(robot, 165)
    assert (signed(answer[:4]), signed(answer[4:])) == (200, 200)


@pytest.mark.parametrize("radius", [150, -150])
def test_arc_to_a_point_ends_there(robot, radius):
    ask(robot, 163, 3, *word(200), *word(50), *word(radius & 0xFFFF), seconds=20.0)
    assert robot.pose[:2] == pytest.approx((0.2, 0.05), abs=2e-3)


def test_motions_are_queued_one_deep_and_a_third_waits_for_its_answer(robot):
    for _ in range(2):
        assert len(ask(robot, 164, 5, *word(90), seconds=0.1)) == 11
    third = say(robot, packet(164, 5, *word(90)), 0.1)
    assert len(third) == 9  # accepted when the first has ended
    robot.advance(10.0)
    assert len(robot.transmit()) == 11
    assert math.degrees(robot.pose.heading) == pytest.approx(270, abs=1)


def test_ready_is_said_when_the_motion_is_over(robot):
    ask(robot, 164, 5, *word(90), seconds=0.1)
    assert ask(robot, 170, seconds=0.05)[4] == 0
    robot.advance(5.0)
    assert ask(robot, 170)[4] == 1


def test_the_last_motion_of_a_path_waits_for_its_end(robot):
    ask(robot, 161, 1, *word(15))
    ask(robot, 162, 5, *word(100), *word(0), seconds=5.0)
    assert robot.pose.x == 0.0
    ask(robot, 162, 5, *word(100), *word(0), seconds=5.0)
    assert robot.pose.x == pytest.approx(0.1, abs=5e-4)
    ask(robot, 161, 0, seconds=5.0)
    assert robot.pose.x == pytest.approx(0.2, abs=5e-4)


def test_path_speed_15_is_188_mm_a_second(robot):
    ask(robot, 161, 1, *word(15))
    ask(robot, 162, 5, *word(1000), *word(0))
    ask(robot, 161, 0, seconds=2.0)
    assert robot.wheel_speeds() == pytest.approx((0.1875, 0.1875))


def test_wheel_distances_keep_rolling(robot):
    ask(robot, 162, 13, *word(100), *word(100), seconds=20.0)
    assert robot.wheel_speeds()[0] > 0
    assert robot.pose.x > 1.0


def test_motors_off_ends_motions_and_forgets_what_waits(robot):
    ask(robot, 162, 5, *word(500), *word(100), seconds=0.5)
    ask(robot, 108)
    at = robot.pose
    robot.advance(10.0)
    assert robot.pose == at


def test_a_blocked_motion_ends_because_the_wheels_slip():
    robot = make("s2")
    ask(robot, 162, 5, *word(2000), *word(0), seconds=60.0)
    assert ask(robot, 170)[4] == 1
    assert robot.wheel_speeds() == (0.0, 0.0)


def test_placing_the_robot_drops_motions_that_waited(robot):
    for _ in range(2):
        robot.receive(packet(162, 5, *word(100), *word(50)))
    robot.advance(0.5)
    assert len(robot.transmit()) == 20 + 9, "the second waits for the first"
    robot.place(Pose(1.0, 1.0, 0.0), 1)
    robot.advance(0.01)
    assert robot.wheel_speeds() == (0.0, 0.0)


# time


def drive(cuts, seed=3):
    robot = Emulator("s2", "2", seed=seed)
    robot.place(Pose(0.5, 0.3, 0.3), seed)
    out, begun = b"", robot.now
    for k in range(20):
        robot.receive(packet(109, 100 + 5 * k, 180 - 7 * k))
        until = begun + 0.5 * (k + 1)
        for cut in cuts:
            robot.advance(max(0.0, min(cut, until - robot.now)))
            out += robot.transmit()
        robot.advance_to(round(until * 1e9))
        out += robot.transmit()
    return out, robot.path(), robot.cells()


def test_physics_do_not_depend_on_how_time_is_cut():
    whole = drive([])
    rng = np.random.default_rng(1)
    for cuts in ([0.001] * 600, rng.exponential(0.01, 80).tolist()):
        pieces = drive(cuts)
        assert pieces[0] == whole[0]
        assert np.array_equal(pieces[1], whole[1])
        assert pieces[2] == whole[2]


def test_another_seed_gives_other_noise_and_the_same_motion():
    one, other = drive([], 3), drive([], 4)
    assert one[0] != other[0]
    assert np.array_equal(one[1], other[1])


def test_a_trial_is_a_function_of_its_pose_and_seed():
    def trial(robot):
        robot.place(Pose(0.4, 0.3, 1.0), 77)
        out = b""
        for k in range(10):
            robot.receive(packet(109, 190 - 9 * k, 120 + 3 * k))
            robot.advance(0.5)
            out += robot.transmit()
        path = robot.path()
        return out, path[:, 1:], path[:, 0] - path[0, 0]

    fresh = Emulator("s2", "2", seed=1)
    used = Emulator("s2", "2", seed=9)
    say(used, packet(109, 30, 190), 7.1234567)
    one, other = trial(fresh), trial(used)
    assert one[0] == other[0]
    assert np.array_equal(one[1], other[1])
    assert np.allclose(one[2], other[2], atol=1e-9)
    assert one[0] == trial(fresh)[0]


def test_position_answers_are_signed_longs(robot):
    ask(robot, 166, *long(-5), *long(-7))
    ask(robot, 162, 5, *word(-10 & 0xFFFF), *word(0), seconds=5.0)
    answer = ask(robot, 165)
    assert (signed(answer[:4]), signed(answer[4:])) == (-15, -7)
