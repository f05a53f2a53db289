"""Arenas from TOML files."""

import pytest

from realitygap.emulator import Emulator, open_scene
from realitygap.errors import RobotError

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
        ("walls", "wals", "unknown key 'wals'. Did you mean 'walls'"),
        ("[0, 0, 2, 0]", "[0, 0, 2]", "walls[0] is"),
        ("[0, 0, 2, 0]", "[0, 0, 2, nan]", "walls[0] is"),
        ("rows = 5", "rows = 50", "at most 256 cells"),
        ("rows = 5", "", "[grid] is"),
        ("cell = 0.1", "cell = 0", "larger than 0"),
        ("start = [0.3, 0.25, 0.0]", "", "start is missing"),
        ("start = [0.3, 0.25, 0.0]", 'start = "middle"', "start is 'middle'"),
        ("lamps = [[2.0, 0.25, 3.0]]", "lamps = 3", "lamps is 3"),
        ('"corridor"', "7", "name is 7"),
        ("[grid]", "[grid", "not a TOML file"),
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
