"""A `JyroWorld` against what real Jyro 0.3.2 did with several robots and all of its devices."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from realitygap.classroom import jyro
from realitygap.drawing import rgb_of
from tests.classroom.jyro import jyro_worlds

# References are rounded to ten decimals. Headings pass through ours and back, which changes the last bit, and
# what stands 1000 m away carries it to the tenth decimal.
NEAR = 3e-10
DRAWN_LAMP = (255, 255, 0)


@pytest.mark.parametrize("name", jyro_worlds.SETUPS)
def test_real_jyro_did_the_same(name: str) -> None:
    compared = 0
    for number, robot, expected in jyro_worlds.carry_out(name):
        at = f"{name}, step {number}, {robot.name}"
        x, y, heading = expected["pose"]
        assert (robot.pose.x, robot.pose.y) == pytest.approx((x, y), abs=NEAR), at
        assert abs(math.remainder(robot.pose.heading - heading - math.pi / 2, 2 * math.pi)) < NEAR, at
        assert robot.stalled == bool(expected["stall"]), at
        assert robot.energy == expected.get("energy", robot.energy), at
        for device, readings in zip(robot.devices, expected.get("readings", ()), strict=False):
            compared += 1
            if isinstance(device, jyro.Camera):
                assert np.array_equal(device.image, jyro_worlds.picture(readings)), at
            else:
                assert isinstance(device, jyro.MountedSensors | jyro.Gripper)
                np.testing.assert_allclose(device.readings, readings, rtol=0, atol=NEAR, err_msg=at)
    assert compared >= 15


def test_odometry_and_trail_are_jyros() -> None:
    """The second robot moves sideways, where Jyro's odometry goes to the wrong side."""
    for number, robot, expected in jyro_worlds.carry_out("motion"):
        assert len(robot.trail) == expected["trail"], (number, robot.name)
        if robot.name == "r0":
            x, y, heading = expected["odometry"]
            assert robot.odometry[:2] == pytest.approx((x, y), abs=NEAR), number
            assert abs(math.remainder(robot.odometry.heading - heading, 2 * math.pi)) < NEAR, number


def test_the_references_hold_what_they_should() -> None:
    setups = {name: jyro_worlds.read(name) for name in jyro_worlds.SETUPS}
    kinds = Counter(
        device["kind"]
        for setup in setups.values()
        for robot in setup["robots"]
        for device in robot["devices"]
    )
    assert set(kinds) == {
        "Camera", "DepthCamera", "Gripper", "LightSensor", "MyroBumper", "MyroIR", "Pioneer16Sonars",
        "Pioneer4FrontLightSensors", "Pioneer4Sonars", "PioneerBackSonars", "PioneerFrontLightSensors",
        "PioneerFrontSonar", "PioneerFrontSonars", "RangeSensor",
    }  # fmt: skip
    assert {robot["kind"] for setup in setups.values() for robot in setup["robots"]} == {
        "Scribbler", "Pioneer", "Robot", "Puck", "Blimp",
    }  # fmt: skip
    stalls = [bool(robot["stall"]) for setup in setups.values() for row in setup["rows"] for robot in row]
    assert 0.1 < np.mean(stalls) < 0.5
    pictures = [
        jyro_worlds.picture(readings)
        for name, setup in setups.items()
        if name.startswith("cameras")
        for row in setup["rows"]
        for robot in row[:2]
        for readings in robot.get("readings", ())
    ]
    assert len({picture.tobytes() for picture in pictures}) > 30
    assert sum((picture == DRAWN_LAMP).all(axis=2).any() for picture in pictures) > 5
    gripped = [robot["pose"][0] for row in setups["gripper-2"]["rows"] for robot in row[1:2]]
    assert gripped[0] == 1.3
    assert gripped[-1] == -1000


def test_groups_are_jyros() -> None:
    for kind, groups in jyro_worlds.read("groups").items():
        device = getattr(jyro, kind)(*([1.0] if "Light" in kind else []))
        assert {name: list(which) for name, which in device.groups.items()} == groups, kind


def test_colors_are_jyros_but_for_two_slips_of_its_table() -> None:
    colors = jyro_worlds.read("colors")
    ground = colors.pop("backgroundgreen")
    assert rgb_of(jyro._camera.GROUND) == tuple(bytes.fromhex(ground))
    assert colors.pop("tomato12") == "{:02x}{:02x}{:02x}".format(*(55, 99, 71))  # tomato1 is meant
    assert rgb_of("tomato1") == (255, 99, 71)
    different = [name for name, code in colors.items() if rgb_of(name) != tuple(bytes.fromhex(code))]
    assert different == ["palevioletred3"]
    assert len(colors) == 656
