"""What a `JyroWorld` does beyond Jyro, where Jyro is broken, and what it refuses."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realitygap.classroom.jyro import (
    Blimp,
    Bumper,
    Camera,
    DepthCamera,
    Device,
    DrivenRobot,
    Gripper,
    JyroWorld,
    LightSensor,
    MyroIR,
    MyroLightSensors,
    Pioneer,
    Pioneer4Sonars,
    PioneerFrontSonars,
    Puck,
    RangeSensor,
    SceneRobot,
    Scribbler,
)
from realitygap.drawing import Line
from realitygap.errors import RobotError
from realitygap.robots import Robot
from realitygap.testing import check_robot
from realitygap.trials import simulate_case
from realitygap.world import Case, Light, Obstacle, Pose, paper_arena

AHEAD = [[0.09, 0.0, 0.0]]


def room(width: float = 3.0, height: float = 2.0) -> JyroWorld:
    world = JyroWorld()
    world.add_box(0, 0, width, height, "beige", "saddlebrown")
    return world


# several robots


def test_the_first_robot_takes_the_gap_and_the_second_meets_it_there() -> None:
    world = JyroWorld()
    first, second = world.add(Scribbler(0.80, 0.5)), world.add(Scribbler(1.15, 0.5, math.pi))
    first.move(1.0, 0.0)
    second.move(1.0, 0.0)
    world.step()
    assert (first.stalled, second.stalled) == (False, True)
    assert first.pose.x == pytest.approx(0.9)
    assert second.pose.x == 1.15


def test_robots_see_each_other_and_a_blimp_is_seen_by_nobody() -> None:
    world = room()
    one, other = world.add(Scribbler(0.5, 0.5)), world.add(Scribbler(1.0, 0.5, math.pi))
    world.add(Blimp(1.5, 0.5))
    front, back = one.add(RangeSensor(AHEAD, 5.0)), other.add(RangeSensor([[-0.09, 0.0, math.pi]], 5.0))
    assert front.readings == pytest.approx([0.32], abs=1e-6)
    assert back.readings == pytest.approx([1.91], abs=1e-6)


def test_a_brain_sees_what_earlier_robots_did_in_the_same_step() -> None:
    world = JyroWorld()
    seen: list[float] = []
    leader = world.add(Scribbler(0.0, 0.0, brain=lambda robot: robot.move(1.0, 0.0)))
    world.add(Scribbler(-1.0, 0.0, brain=lambda robot: seen.append(leader.pose.x)))
    world.step(2)
    world.step(1, brains=False)
    assert seen == pytest.approx([0.1, 0.2])
    assert leader.pose.x == pytest.approx(0.3)


def test_a_world_of_one_or_more_is_what_simulate_does() -> None:
    """Both step the same kernel; headings pass through ours and back, which changes the last bit."""
    rng = np.random.default_rng(5)
    commands = np.repeat(rng.uniform((-0.5, -1), 1, (5, 2, 2)), 8, axis=0)
    starts = [(0.4, 0.3, 0.3), (0.8, 0.3, 2.0)]
    mounts = [[0.09, 0.05, 0.0], [0.09, -0.05, 0.0]]
    case = Case.from_dict(
        {
            "steps": 40,
            "world": {"boxes": [[0, 0, 1.2, 0.7]]},
            "robots": [
                {
                    "start": {"x": x, "y": y, "heading": heading},
                    "devices": [{"kind": "range", "geometry": mounts, "max_range": 0.4}],
                    "commands": commands[:, k].tolist(),
                }
                for k, (x, y, heading) in enumerate(starts)
            ],
        }
    )
    track = simulate_case(case)
    world = room(1.2, 0.7)
    robots = [world.add(Scribbler(x, y, heading + math.pi / 2)) for x, y, heading in starts]
    sensors = [robot.add(RangeSensor(mounts, 0.4)) for robot in robots]
    for step in range(40):
        for k, robot in enumerate(robots):
            robot.move(*commands[step, k])
        world.step()
        for k, robot in enumerate(robots):
            assert robot.pose[:2] == pytest.approx(track.poses[step + 1, k, :2], abs=1e-12)
            assert robot.stalled == bool(track.stalls[step + 1, k])
            np.testing.assert_allclose(sensors[k].readings, track.readings[k][step + 1], rtol=0, atol=1e-9)
    assert 0.1 < track.stalls[1:].mean() < 0.9


def test_an_arena_brings_its_obstacles_and_lights() -> None:
    box = Obstacle(0.6, 0.3, 0.0, ((0.05, 0.05), (-0.05, 0.05), (-0.05, -0.05), (0.05, -0.05)))
    disc = Obstacle(0.3, 0.5, radius=0.04)
    arena = replace(paper_arena(), obstacles=(box, disc), lights=(Light(0.9, 0.3, 2.0),))
    world = JyroWorld(arena)
    robot = world.add(Scribbler(0.3, 0.3))
    ahead = robot.add(RangeSensor([[0.0, 0.0, 0.0], [0.0, 0.0, math.pi / 2]], 5.0))
    light = robot.add(LightSensor(AHEAD, 1.0))
    assert ahead.readings == pytest.approx([0.25, 0.16], abs=1e-6)
    assert light.readings == pytest.approx([0.5 * 2.0 * (1 - 0.51)], abs=1e-6)
    assert len(world.walls) == 4 + 4 + 32
    with pytest.raises(ValueError, match="The polygon has 2 corners"):
        world.add_polygon([(0.0, 0.0), (1.0, 1.0)])


# robots


def test_a_robot_that_moves_sideways_knows_where_it_is() -> None:
    """Jyro's odometry went to the other side."""
    world = JyroWorld()
    robot = world.add(Pioneer(1.0, 1.0, 0.7))
    robot.move(0.4, 0.9)
    robot.sideways = 0.3
    world.step(25)
    start, x, y = Pose(1.0, 1.0, 0.7), *robot.odometry[:2]
    sine, cosine = math.sin(start.heading), math.cos(start.heading)
    assert robot.pose[:2] == pytest.approx((1.0 + x * cosine - y * sine, 1.0 + x * sine + y * cosine))
    robot.stop()
    robot.place(start)
    robot.localize()
    robot.sideways = 0.5
    world.step()
    assert robot.odometry == pytest.approx((0.0, 0.05, 0.0))


def test_a_single_edge_collides_and_is_seen() -> None:
    world = room()
    rammer = world.add(
        SceneRobot(0.5, 0.5, body=[(0.05, 0.05), (0.05, -0.05), (-0.05, 0.0)], segments=[(0.05, 0, 0.4, 0)])
    )
    watcher = world.add(Scribbler(0.8, 1.5, -math.pi / 2))
    eye = watcher.add(RangeSensor(AHEAD, 3.0))
    assert eye.readings == pytest.approx([0.91], abs=1e-6)
    rammer.move(1.0, 0.0)
    world.step(40)
    assert rammer.stalled
    assert rammer.pose.x == pytest.approx(2.5)


def test_a_reset_is_the_beginning() -> None:
    world = room()
    lamp = world.add_light(1.0, 1.0)
    robot = world.add(Pioneer(0.5, 0.5, 0.2))
    gripper, sonars = robot.add(Gripper()), robot.add(PioneerFrontSonars())
    robot.keep_trail = True
    before = world.to_dict()
    robot.move(0.3, 0.4)
    gripper.close()
    lamp.brightness = 3.0
    world.step(7)
    assert robot.trail
    assert not gripper.is_open
    world.reset()
    assert world.to_dict() == before
    assert sonars.readings.tolist() == before["robots"][0]["devices"][1]["readings"]
    assert json.loads(json.dumps(before)) == before


def test_time_is_rounded_to_whole_steps() -> None:
    """Jyro makes two steps of 0.3 s."""
    world = JyroWorld()
    world.run(0.3)
    assert world.n_steps == 3
    world = JyroWorld(step_s=0.05)
    world.run(1.0)
    assert (world.n_steps, world.time) == (20, pytest.approx(1.0))


def test_real_time_takes_as_long() -> None:
    import time

    began = time.perf_counter()
    JyroWorld(step_s=0.02).run(0.1, real_time=True)
    assert 0.1 <= time.perf_counter() - began < 5


# devices


def test_an_arc_reads_the_nearest_over_its_width() -> None:
    world = room()
    robot = world.add(Scribbler(1.0, 1.0, 0.3))
    thin, wide = robot.add(RangeSensor(AHEAD, 9.0)), robot.add(RangeSensor(AHEAD, 9.0, arc=0.6))
    angles = 0.3 + np.linspace(-0.3, 0.3, 5)
    x, y = robot.point(0.09, 0.0)
    assert thin.readings == pytest.approx([min((3 - x) / math.cos(0.3), (2 - y) / math.sin(0.3))], abs=1e-6)
    ways = [min((3 - x) / math.cos(a), (2 - y) / math.sin(a) if a > 0 else 99) for a in angles]
    assert wide.readings == pytest.approx([min(ways)], abs=1e-6)


def test_noise_moves_a_reading_by_its_level_and_starts_anew_with_a_reset() -> None:
    world = JyroWorld(seed=3)
    world.add_wall(1.0, -5.0, 1.0, 5.0)
    robot = world.add(Scribbler(0.0, 0.0))
    sensor = robot.add(RangeSensor([[0.0, 0.0, 0.0]] * 400, 2.0, noise=0.1))
    world.reset()
    first = sensor.readings
    assert abs(first - 1.0).max() <= 0.2
    assert first.std() == pytest.approx(0.2 / math.sqrt(3), rel=0.1)  # chance alone: once in 10^4
    world.step()
    assert not np.array_equal(sensor.readings, first)
    world.reset()
    assert np.array_equal(sensor.readings, first)


def test_an_inactive_device_keeps_its_readings() -> None:
    world = room()
    robot = world.add(Scribbler(1.0, 1.0))
    eye = robot.add(RangeSensor(AHEAD, 3.0))
    eye.active = False
    before = eye.readings
    robot.move(1.0, 0.0)
    world.step(3)
    assert np.array_equal(eye.readings, before)
    eye.active = True
    world.step()
    assert eye.readings[0] == pytest.approx(before[0] - 0.4, abs=1e-6)


def test_groups_name_parts_of_the_readings() -> None:
    world = room()
    sonars = world.add(Pioneer(1.0, 1.0)).add(PioneerFrontSonars())
    assert sonars.group("front").tolist() == sonars.readings[3:5].tolist()
    assert sonars.group("back").tolist() == []
    with pytest.raises(KeyError, match="No group 'top'; there are: all, back"):
        sonars.group("top")


def test_bumpers_read_1_within_their_length() -> None:
    world = room()
    robot = world.add(Scribbler(2.75, 1.0))
    bumper = robot.add(Bumper([[0.09, 0.0, 0.0], [-0.09, 0.0, math.pi]], 0.2))
    assert bumper.readings.tolist() == [1.0, 0.0]
    assert bumper.nearness.tolist() == [1.0, 0.0]


def test_myro_light_sensors_work() -> None:
    """In Jyro making one fails."""
    world = JyroWorld()
    world.add_light(0.0, 1.0)
    sensors = world.add(Scribbler(0.0, 0.0)).add(MyroLightSensors(2.0, mode="ambient"))
    distances = np.hypot([0.18, 0.18], [0.87, 1.13])
    assert sensors.readings == pytest.approx(0.2 / distances, abs=1e-6)


def test_light_is_halved_in_a_shadow_unless_it_passes_over_walls() -> None:
    world = JyroWorld()
    world.add_light(1.0, 0.0, brightness=2.0)
    sensor = world.add(Scribbler(0.0, 0.0)).add(LightSensor([[-0.05, 0.0, 0.0]], 2.1))
    assert sensor.readings == pytest.approx([1.0])
    world.add_wall(0.5, -1.0, 0.5, 1.0)
    assert sensor.readings == pytest.approx([0.5])
    world.light_above_walls = True
    world.step()
    assert sensor.readings == pytest.approx([1.0])
    sensor.own_shadow = True
    world.step()
    assert sensor.readings == pytest.approx([0.5])


def test_a_camera_of_another_size_shows_the_same() -> None:
    """Jyro's image is always 60 x 40."""
    world = room()
    world.add(Scribbler(1.5, 1.0, color="green"))
    eye = world.add(Pioneer(0.5, 1.0))
    small, large = eye.add(Camera()), eye.add(Camera(120, 80))
    assert small.image.shape == (40, 60, 3)
    assert large.image.shape == (80, 120, 3)
    np.testing.assert_allclose(large.pixels * 255, large.image, atol=1e-4)
    same = (small.image == large.image[1::2, 1::2]).all(axis=2)
    assert same.mean() > 0.85  # but for borders of bars and steps of shade


def test_a_camera_shows_robots_in_their_color_half_as_tall_as_walls() -> None:
    world = room(3.0, 2.0)
    world.add(Scribbler(1.5, 1.0, color="blue"))
    camera = world.add(Pioneer(0.5, 1.0)).add(Camera(fade=False))
    assert camera.image[20, 30].tolist() == [0, 0, 255]
    assert camera.image[20, 5].tolist() == [139, 69, 19]
    robot, wall = camera.columns[30], camera.columns[2]
    assert robot is not None
    assert wall is not None
    assert robot.height == int(robot.closeness**2 * 10)
    assert wall.height == int(wall.closeness**2 * 20)
    assert camera._repr_png_()[:4] == b"\x89PNG"


def test_a_lamp_is_seen_in_its_color() -> None:
    world = JyroWorld()
    world.add_light(1.0, 0.0, color="red")
    camera = world.add(Pioneer(0.0, 0.0)).add(Camera())
    assert camera.image[20, 30].tolist() == [255, 0, 0]


def test_a_robot_can_have_both_cameras() -> None:
    """In Jyro the depth camera hid the other."""
    robot = room().add(Pioneer(0.5, 1.0))
    color, depth = robot.add(Camera()), robot.add(DepthCamera(3.0))
    assert robot["camera"] is color
    assert robot["depth-camera"] is depth
    gray = depth.image
    assert (gray[..., 0] == gray[..., 1]).all()
    assert gray[20, 30, 0] == int(255 * (1 - 2.5 / 3.0))


def test_a_gripper_stores_a_puck_and_deploys_it() -> None:
    """In Jyro the stored one never comes back."""
    world = room()
    robot = world.add(Pioneer(0.5, 1.0))
    gripper = robot.add(Gripper())
    puck = world.add(Puck(0.83, 1.0, body=[(0.04, 0.04), (0.04, -0.04), (-0.04, -0.04), (-0.04, 0.04)]))
    world.step()
    assert gripper.readings.tolist() == [1, 1, 0, 1, 0]
    gripper.store()
    assert gripper.storage == [puck]
    world.step(13)
    assert gripper.readings.tolist() == [0, 0, 1, 0, 0]
    robot.move(0.5, 0.0)
    world.step(10)
    robot.stop()
    gripper.deploy()
    world.step(13)
    assert gripper.storage == []
    assert puck.pose == pytest.approx((1.0 + 0.33, 1.0, 0.0))
    assert gripper.readings.tolist() == [1, 1, 0, 1, 0]


def test_a_gripper_that_closes_on_a_body_stalls_its_robot() -> None:
    world = room()
    robot = world.add(Pioneer(0.5, 1.0))
    gripper = robot.add(Gripper())
    world.add(Puck(0.83, 1.0, body=[(0.04, 0.04), (0.04, -0.04), (-0.04, -0.04), (-0.04, 0.04)]))
    gripper.close()
    world.step(20)
    assert robot.stalled
    assert gripper.opening == pytest.approx(0.05)
    assert gripper.is_moving


def test_storing_the_paddle_of_another_gripper_takes_its_robot() -> None:
    """In Jyro it failed: paddles did not know whose they are."""
    world = room()
    robot, other = world.add(Pioneer(0.5, 1.0)), world.add(Pioneer(1.28, 1.05, math.pi))
    gripper = robot.add(Gripper())
    other.add(Gripper()).opening = 0.03
    world.reset()
    other["gripper"].opening = 0.03
    world.step()
    assert gripper.beams[1]
    gripper.store()
    assert gripper.storage == [other]


def test_a_custom_device_reads_its_robot_in_each_step() -> None:
    class Compass(Device):
        kind = "compass"

        def read(self) -> None:
            self.heading = self.robot.pose.heading

    world = JyroWorld()
    robot = world.add(Scribbler(0.0, 0.0, 0.5))
    compass = robot.add(Compass())
    robot.rotate(1.0)
    world.step(3)
    assert robot["compass"] is compass
    assert compass.heading == pytest.approx(0.8)


# what it is driven and shown by


def test_a_robot_of_it_keeps_the_contract() -> None:
    world = JyroWorld(paper_arena())
    robot = world.add(Scribbler(0.3, 0.3))
    robot.add(MyroIR())
    robot.add(Bumper(AHEAD, 0.1))
    driven = DrivenRobot(robot)
    assert isinstance(driven, Robot)
    assert driven.n_sensors == 3
    check_robot(driven)


def test_a_driven_robot_drives_in_the_world() -> None:
    world = JyroWorld(paper_arena())
    robot = world.add(Scribbler(0.3, 0.3))
    sensor = robot.add(RangeSensor([[0.09, 0.05, 0.0], [0.09, -0.05, 0.0]], 0.2))
    with DrivenRobot(robot) as driven:
        driven.reset(Pose(0.5, 0.3, 0.0))
        while not driven.observe().stalled:
            driven.drive((1.0, 0.0))
        seen = driven.observe()
    assert seen.raw == tuple(sensor.readings.tolist())
    assert seen.readings == pytest.approx([1 - reading / 0.2 for reading in seen.raw])
    assert robot.pose.x == pytest.approx(0.9)
    with pytest.raises(RobotError, match="closed"):
        driven.observe()


def test_the_picture_shows_everything() -> None:
    world = room()
    world.add_light(2.0, 1.5)
    world.add_shape(Line(((0.0, 0.0), (3.0, 2.0)), "#123456"))
    robot = world.add(Pioneer(0.6, 1.0, color="orchid"))
    for device in (Camera(), Gripper(), Pioneer4Sonars(), MyroLightSensors(3.0)):
        robot.add(device)
    robot.say("I see <you>")
    world.add(Scribbler(1.5, 0.5)).keep_trail = True
    world.robots[1].move(0.3, 0.3)
    world.add(Puck(1.0, 1.7))
    world.add(Blimp(2.4, 0.6, color="pink"))
    world.step(5)
    svg = world._repr_svg_()
    root = ElementTree.fromstring(svg)
    assert "I see &lt;you&gt;" in svg
    assert "#123456" in svg
    assert "#da70d6" in svg
    assert "World of 3 by 2 m with 4 robots after 5 steps, 0.5 s; blocked: none." in root.attrib["aria-label"]
    robot.move(0.2, 0.0)
    world.step(120)
    assert "blocked: pioneer-1" in world._repr_svg_()


def test_a_robot_shows_itself_without_a_world() -> None:
    robot = Pioneer(3.0, 4.0, color="orchid")
    robot.add(Gripper())
    assert "#da70d6" in robot._repr_svg_()
    assert "with 1 devices" in robot._repr_svg_()


def test_parts_of_a_picture_can_be_hidden() -> None:
    world = room()
    robot = world.add(Pioneer(0.6, 1.0, color="orchid"))
    robot.add(Pioneer4Sonars())
    assert "#da70d6" not in world.picture(hide=["bodies"]).to_svg()
    assert len(world.picture().shapes) - len(world.picture(hide=["rays"]).shapes) == 4
    with pytest.raises(ValueError, match="Unknown part 'ray'"):
        world.picture(hide=["ray"])


def test_a_world_is_saved_as_picture_and_movie(tmp_path: Path) -> None:
    world = room()
    robot = world.add(Scribbler(1.0, 1.0))
    robot.move(0.3, 0.5)
    assert world.save(tmp_path / "world.svg").read_text() == world._repr_svg_()
    with Image.open(world.save(tmp_path / "world.png", width=300)) as image:
        assert image.size[0] == 300
    with Image.open(world.save_movie(tmp_path / "world.gif", 10, every=2, width=200)) as movie:
        assert movie.n_frames == 6
        assert movie.info["duration"] == 200
    assert world.n_steps == 10
    for call in (world.save, lambda path: world.save_movie(path, 3)):
        with pytest.raises(ValueError, match=r"ends in \.jpg, expected"):
            call(tmp_path / "world.jpg")


def test_an_empty_world_has_a_picture() -> None:
    world = JyroWorld()
    assert "0 robots" in world._repr_svg_()
    world.add(Scribbler(50.0, 50.0))
    assert world.picture().left == pytest.approx(49.47)


# what it refuses


def test_mistakes_are_named() -> None:
    world = JyroWorld()
    robot = world.add(Scribbler(0.0, 0.0, name="ada"))
    with pytest.raises(RobotError, match="There is a robot named 'ada' already"):
        world.add(Scribbler(1.0, 0.0, name="ada"))
    with pytest.raises(RobotError, match="ada is in a world already"):
        world.add(robot)
    with pytest.raises(KeyError, match="No robot 'eve'; there are: ada"):
        world["eve"]
    with pytest.raises(KeyError, match="ada has no device 'ir'; it has: none"):
        robot["ir"]
    with pytest.raises(RobotError, match=r"is in no world: call world\.add"):
        Scribbler(0.0, 0.0).add(MyroIR()).read()
    with pytest.raises(RobotError, match="This ir is on ada already"):
        robot.add(robot.add(MyroIR()))
    with pytest.raises(ValueError, match=r"Unknown color 'rde'\. Did you mean 'red'"):
        Scribbler(0.0, 0.0, color="rde")
    with pytest.raises(ValueError, match=r"Unknown color 'qqqq'\. Give an X11 name"):
        world.add_light(0.0, 0.0, color="qqqq")
    with pytest.raises(ValueError, match="expected three numbers"):
        Scribbler(math.nan, 0.0)
    with pytest.raises(ValueError, match="max_range is -1"):
        RangeSensor(AHEAD, -1.0)
    with pytest.raises(ValueError, match="expected for each sensor three numbers"):
        RangeSensor([[0.0, 0.0]], 1.0)
    with pytest.raises(ValueError, match="Unknown mode 'linaer', expected one of: linear, ambient, direct"):
        LightSensor(AHEAD, 1.0, mode="linaer")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="at least 2 x 2 pixels"):
        Camera(1, 1)
    with pytest.raises(ValueError, match="A segment is"):
        SceneRobot(0.0, 0.0, segments=[(1.0, 2.0)])
    with pytest.raises(ValueError, match="step_s is 0"):
        JyroWorld(step_s=0)
    with pytest.raises(RobotError, match="has no range sensor"):
        DrivenRobot(world.add(Pioneer(3.0, 0.0)))
