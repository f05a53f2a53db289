"""Arenas from TOML files."""

import numpy as np
import pytest

from realitygap.emulator import Walls
from realitygap.errors import RobotError
from realitygap.families.scribbler.emulator import Emulator, open_scene
from realitygap.families.scribbler.emulator._view import picture

from .wire import ask

GOOD = """
name = "corridor"
walls = [[0, 0, 2, 0], [0, 0.5, 2, 0.5]]
start = [0.3, 0.25, 0.0]
lamps = [[2.0, 0.25, 3.0]]
tape = [[0.2, 0.25, 1.0, 0.25]]
[grid]
x = 0.0
y = 0.0
cell = 0.1
columns = 20
rows = 5
"""


def test_paper_is_known_by_name():
    assert open_scene("paper").arena.grid.n_cells == 72


def test_walls_grid_start_lamps_and_tape_come_from_the_file(tmp_path):
    file = tmp_path / "corridor.toml"
    file.write_text(GOOD)
    scene = open_scene(str(file))
    assert scene.arena.name == "corridor"
    assert len(scene.arena.walls) == 2
    robot = Emulator("s2", "none", arena=scene)
    block = ask(robot, 65)
    assert block[8:10] == b"\1\1", "both line sensors are on the tape"
    left, center, right = (int.from_bytes(block[k : k + 2], "big") for k in (2, 4, 6))
    assert center < left, "the lamp is ahead"
    assert center < right
    assert center < 20000


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("walls", "wals", "wals: unknown setting. Did you mean 'wall'?"),
        ("[0, 0, 2, 0]", "[0, 0, 2]", "wall.0: expected [x1, y1, x2, y2], got [0, 0, 2]."),
        ("[0, 0, 2, 0]", "[0, 0, 2, nan]", "wall.0.y2: expected a finite number"),
        ("rows = 5", "rows = 50", "at most 256 cells"),
        ("rows = 5", "", "grid.rows: missing"),
        ("cell = 0.1", "cell = 0", "grid.cell: expected more than 0"),
        ("start = [0.3, 0.25, 0.0]", "", "start: missing"),
        ("start = [0.3, 0.25, 0.0]", 'start = "middle"', "start: expected [x, y, heading], got 'middle'."),
        ("lamps = [[2.0, 0.25, 3.0]]", "lamps = 3", "light.0: expected a table, got 3."),
        ('"corridor"', "7", "name: expected a text in quotes, got 7."),
        ("[grid]", "[grid", "not TOML"),
    ],
)
def test_a_wrong_file_gets_one_clear_message(tmp_path, old, new, says):
    file = tmp_path / "corridor.toml"
    file.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(RobotError) as caught:
        open_scene(str(file))
    assert says in str(caught.value)
    assert str(file) in str(caught.value)


def test_an_unknown_name_is_neither_file_nor_preset():
    with pytest.raises(RobotError, match="Did you mean 'paper'"):
        open_scene("papre")


BOXES = """
wall = [[0, 0, 2, 0], [2, 0, 2, 1], [2, 1, 0, 1], [0, 1, 0, 0]]
start = [0.4, 0.5, 0.0]
[[obstacle]]
x = 1.0
y = 0.5
radius = 0.1
[[obstacle]]
x = 1.0
y = 0.9
box = [0.2, 0.1]
radius = 0.02
"""


def test_a_robot_sees_obstacles_and_stops_at_them(tmp_path):
    file = tmp_path / "boxes.toml"
    file.write_text(BOXES)
    robot = Emulator("s2", "none", arena=open_scene(str(file)), timing=False)
    mounts = np.array([[0.0, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, -0.3, 0.0]])
    assert robot.table.robot.ranges(mounts, 2.0) == pytest.approx([0.5, 0.5, 1.6])
    robot.receive(bytes((109, 200, 200)) + bytes(6))
    robot.advance(3.5)
    assert robot.pose.x + 0.089 == pytest.approx(0.9, abs=0.01), "at the disc"
    assert robot.table.stalled


def test_a_robot_drives_past_the_rounded_corner_of_a_box(tmp_path):
    file = tmp_path / "boxes.toml"
    file.write_text(BOXES)
    arena = open_scene(str(file)).arena
    walls = Walls.of(arena)
    corner = arena.obstacles[1].placed[2]  # the lower left one, which is round
    aside = corner[0] - 0.02 * 0.71, corner[1] - 0.02 * 0.71
    assert walls.nearest(*aside) == pytest.approx(0.0, abs=1e-3)
    square = np.array([0.0, 0.1, 0.1, 0.0])
    for by, touches in ((0.0005, False), (-0.0005, True)):
        xs, ys = aside[0] - 0.1 - by + square, aside[1] - 0.1 - by + np.roll(square, 1)
        assert walls.touch(xs, ys) is touches


def test_an_arena_whose_numbers_are_drawn_is_refused(tmp_path):
    file = tmp_path / "drawn.toml"
    file.write_text(BOXES.replace("0.4, 0.5, 0.0", "{ uniform = [0.3, 0.4] }, 0.5, 0.0"))
    with pytest.raises(RobotError, match=r"arena\.start\.x are drawn"):
        open_scene(str(file))


def test_the_live_view_shows_obstacles(tmp_path):
    file = tmp_path / "boxes.toml"
    file.write_text(BOXES)
    lines = picture(Emulator("s2", "none", arena=open_scene(str(file))), 60, 20)
    assert "#" in lines[len(lines) // 2][25:35], "the disc in the middle"
