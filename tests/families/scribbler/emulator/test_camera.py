"""Pictures: what they show, and the formats they come in."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from realitygap.families.scribbler.emulator import Emulator, Scene
from realitygap.world import Floor, Pose, paper_arena

from .wire import make, say

SIZES = {"1": (256, 192), "2": (1280, 800)}


def jpeg(robot, *, in_color, careful=1):
    """Header and scan put together as clients do, and the three times."""
    header_op, scan_op = (137, 138) if in_color else (135, 136)
    header = say(robot, bytes((header_op,)), 2.0)
    length = int.from_bytes(header[:2], "little")
    assert len(header) == length + 2
    scan = say(robot, bytes((scan_op, careful)), 20.0)
    end = scan.index(b"\xff\xd9") + 2
    times = [int.from_bytes(scan[end + k : end + k + 4], "little") for k in (0, 4, 8)]
    assert len(scan) == end + 12, "FF D9 comes once, at the end, with twelve bytes after it"
    return header[2:], scan[:end], times


@pytest.mark.parametrize("careful", [0, 1])
@pytest.mark.parametrize(("in_color", "length"), [(False, 328), (True, 623)])
@pytest.mark.parametrize("fluke", ["1", "2"])
def test_header_and_scan_make_a_file(fluke, in_color, length, careful):
    robot = make("s2", fluke)
    header, scan, times = jpeg(robot, in_color=in_color, careful=careful)
    assert len(header) == length
    assert header[:2] == b"\xff\xd8"
    assert not scan.startswith(b"\xff\xd8")
    assert times[0] < times[1] <= times[2]
    image = Image.open(io.BytesIO(header + scan))
    image.load()
    assert image.size == ((128, 192) if fluke == "1" else (1280, 800))
    assert image.mode == ("RGB" if in_color else "L")


def test_luminance_of_a_fluke_1_is_sampled_twice_as_wide_as_color():
    header, _, _ = jpeg(make("s2", "1"), in_color=True)
    frame = header.index(b"\xff\xc0")
    assert header[frame + 9] == 3
    assert [header[frame + 11 + 3 * k] for k in range(3)] == [0x21, 0x11, 0x11]


def test_the_jpeg_shows_what_the_raw_picture_shows():
    robot = make("s2", "1", timing=False)
    robot.place(Pose(0.5, 0.3, 0.4), 1)
    raw = np.frombuffer(say(robot, b"\x53"), dtype=np.uint8).reshape(192, 256)
    header, scan, _ = jpeg(robot, in_color=True)
    image = np.asarray(Image.open(io.BytesIO(header + scan)).convert("YCbCr"), dtype=int)
    assert np.abs(image[..., 0] - raw[:, 1::2]).mean() < 3
    assert np.abs(image[:, ::2, 1] - raw[:, 2::4]).mean() < 3
    assert np.abs(image[:, ::2, 2] - raw[:, 0::4]).mean() < 3


def test_a_small_picture_of_a_fluke_2_is_427_by_266():
    robot = make("s2", "2", timing=False)
    say(robot, bytes((11, 71)))
    header, scan, _ = jpeg(robot, in_color=True)
    assert Image.open(io.BytesIO(header + scan)).size == (427, 266)
    say(robot, bytes((11, 99)))  # no such size: as it was
    assert len(say(robot, b"\x53")) == 427 * 266


def raw(fluke, pose, scene=None):
    robot = Emulator("s2", fluke, arena=scene, timing=False)
    robot.place(pose, 1)
    width, height = SIZES[fluke]
    return np.frombuffer(say(robot, b"\x53"), dtype=np.uint8).reshape(height, width).astype(int)


@pytest.mark.parametrize("fluke", ["1", "2"])
def test_the_wall_fills_more_of_the_picture_from_near(fluke):
    """Wood has little U; the camera looks ahead with the Fluke ahead."""

    def wood(x):
        return (raw(fluke, Pose(x, 0.3, 0.0))[:, 2::4] < 110).mean()

    assert wood(0.3) < wood(0.6) < wood(0.9)


def test_the_wall_is_as_high_as_its_distance_says():
    picture = raw("1", Pose(1.0668 - 0.089 - 0.4, 0.3, 0.0))
    is_wood = picture[:, 126] < 110  # a column of U in the middle
    pixels_per_tangent = 128 / math.tan(math.radians(25))
    assert is_wood.sum() == pytest.approx(0.09 / 0.4 * pixels_per_tangent, abs=2)
    below = 95.5 + 0.075 / 0.4 * pixels_per_tangent
    assert np.flatnonzero(is_wood).max() == pytest.approx(below, abs=2)


def test_pictures_are_mirrored_when_the_robot_is():
    left, right = raw("1", Pose(0.5, 0.2, 0.3)), raw("1", Pose(0.5, 0.6096 - 0.2, -0.3))
    assert np.abs(left[:, 2::4] - right[:, 2::4][:, ::-1]).mean() < 2


def test_cell_marks_and_tape_are_on_the_floor():
    pose = Pose(0.3, 0.3, 0.0)
    plain = raw("1", pose)
    assert (plain[150:, 1::2] < 180).any(), "marks between cells"
    taped = raw("1", pose, Scene(replace(paper_arena(), floor=Floor(((0.8, 0.1, 0.8, 0.5),)))))
    assert (taped[:, 1::2] < 60).any()
    assert not (plain[:, 1::2] < 60).any()


def test_windows_of_a_fluke_1_are_turned_over():
    robot = make("s2", "1", timing=False)
    robot.place(Pose(0.5, 0.3, 0.4), 1)
    picture = np.frombuffer(say(robot, b"\x53"), dtype=np.uint8).reshape(192, 256)
    say(robot, bytes((127, 0, 1, 0, 255, 191, 2, 2)))
    window = say(robot, bytes((84, 0)))
    assert len(window) == 128 * 96
    assert window == picture[0::2, 1::2].tobytes()
    say(robot, bytes((127, 1, 10, 0, 19, 9, 1, 1)))  # y 0..9 are the lowest rows
    assert say(robot, bytes((84, 1))) == picture[182:192, 10:20].tobytes()


def test_windows_of_a_fluke_2_have_words():
    robot = make("s2", "2", timing=False)
    say(robot, bytes((127, 0, 0, 1, 0, 0, 4, 255, 3, 31, 2, 2)))
    assert len(say(robot, bytes((84, 0)))) == 640 * 400
    picture = np.frombuffer(say(robot, b"\x53"), dtype=np.uint8).reshape(800, 1280)
    say(robot, bytes((127, 2, 2, 129, 0, 0, 4, 254, 3, 31, 2, 1)))
    total = say(robot, bytes((88, 2)))
    assert int.from_bytes(total, "big") == int(picture[:, 641:1279:2].sum()) & 0xFFFFFF


def test_a_window_without_steps_or_beyond_the_last_is_answered():
    robot = make("s2", "1", timing=False)
    assert len(say(robot, bytes((84, 3)))) == 1  # as after switching on
    say(robot, bytes((127, 9, 0, 0, 3, 3, 0, 0)))
    assert len(say(robot, bytes((84, 0)))) == 16
    say(robot, bytes((127, 0, 200, 0, 100, 191, 1, 1)))
    assert say(robot, bytes((84, 0))) == b""


WOOD = bytes((118, 90, 1, 0, 255, 80, 110, 140, 170))  # limits of Y, U and V


def runs(robot, size):
    answer = say(robot, b"\x52")
    assert len(answer) == 2 + int.from_bytes(answer[:2], "big")
    return [int.from_bytes(answer[k : k + size], "big") for k in range(2, len(answer), size)]


@pytest.mark.parametrize(("fluke", "size"), [("1", 2), ("2", 3)])
def test_run_lengths_tell_which_groups_are_inside(fluke, size):
    robot = make("s2", fluke, timing=False)
    robot.place(Pose(0.7, 0.3, 0.0), 1)
    say(robot, WOOD)
    width, height = SIZES[fluke]
    lengths = runs(robot, size)
    assert sum(lengths) == width * height // 4
    picture = np.frombuffer(say(robot, b"\x53"), dtype=np.uint8).reshape(-1, 4)
    v, y, u, y2 = picture.T.astype(int)
    inside = (v >= 140) & (v <= 170) & (u >= 80) & (u <= 110) & (y >= 0) & (y2 >= 0)
    told = np.zeros(len(inside), dtype=bool)
    at, on = 0, False
    for length in lengths:
        told[at : at + length] = on
        at, on = at + length, not on
    assert (told == inside).all()
    assert inside.mean() > 0.05


def test_short_runs_are_passed_over_and_a_fluke_1_stops_at_2048_bytes():
    robot = make("s2", "1", timing=False)
    camera = robot.fluke._camera
    pattern = np.zeros((192, 64), dtype=bool)
    pattern[:, ::2] = True
    camera._in_colors = lambda: pattern
    say(robot, bytes((118, 90, 1, 0, 255, 0, 255, 0, 255)))
    answer = say(robot, b"\x52")
    assert len(answer) == 2 + 2048 + 2
    say(robot, bytes((118, 90, 2, 0, 255, 0, 255, 0, 255)))
    assert say(robot, b"\x52") == b"\x00\x02" + (192 * 64).to_bytes(2, "big")


@pytest.mark.parametrize("fluke", ["1", "2"])
def test_a_blob_has_its_count_and_its_middle(fluke):
    robot = make("s2", fluke, timing=False)
    robot.place(Pose(0.7, 0.3048, 0.0), 1)
    say(robot, WOOD)
    answer = say(robot, b"\x5f")
    count = int.from_bytes(answer[:2], "big")
    width, height = SIZES[fluke]
    x, y = (answer[2], answer[3]) if fluke == "1" else (answer[2] * 8, answer[3] * 4)
    assert count > 100
    assert x == pytest.approx(width / 2, abs=0.05 * width)
    assert 0.3 * height < y < 0.8 * height
    assert say(robot, b"\x5e\x03") == bytes(4) or fluke == "2"


def test_camera_registers_darken_the_picture_and_can_be_read():
    robot = make("s2", "1", timing=False)
    say(robot, bytes((127, 0, 3, 0, 128, 191, 2, 1)))
    bright = int.from_bytes(say(robot, bytes((88, 0))), "big")
    for register, value in ((0x12, 0x10), (0x13, 0xA0), (0x00, 0), (0x06, 0x40), (0x10, 0x20)):
        assert say(robot, bytes((131, register, value))) == b""
    assert int.from_bytes(say(robot, bytes((88, 0))), "big") < bright / 2
    assert say(robot, bytes((92, 0x06))) == b"\x40"
    say(robot, bytes((129,)))
    assert say(robot, bytes((92, 0x12))) == b"\x14"
    say(robot, bytes((130,)))
    assert say(robot, bytes((92, 0x12))) == b"\x10"
