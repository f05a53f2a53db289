"""Arenas from files: those that come with realitygap, TOML, names of numbers, the start, and mistakes."""

import json
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from realitygap.errors import DescriptionError
from realitygap.runs import Condition
from realitygap.study import load_study
from realitygap.world import (
    Arena,
    ArenaFile,
    ArenaSettings,
    Distribution,
    Obstacle,
    Pose,
    arena_names,
    check_start,
    is_inside,
    load_arena,
    load_robot,
    paper_arena,
)

from .outcomes import made_or_told

ROOM = """
wall = [[0, 0, 2, 0], [2, 0, 2, 1], [2, 1, 0, 1], [0, 1, 0, 0]]
start = [0.5, 0.5, 0]
"""


@pytest.fixture(name="write")
def _write(tmp_path):
    def write(text, name="room.toml"):
        file = tmp_path / name
        file.write_text(text)
        return file

    return write


@pytest.mark.parametrize("name", arena_names())
def test_every_arena_loads_has_cells_and_survives_the_trip_through_json(name):
    arena = load_arena(name)
    assert arena.name == name
    assert 1 <= arena.grid.n_cells <= 256
    assert is_inside(arena, arena.start.x, arena.start.y)
    assert Arena.from_dict(json.loads(json.dumps(arena.to_dict()))) == arena
    assert arena.with_numbers({}) == arena
    check_start(arena, load_robot("khepera"))


def test_the_paper_s_arena_has_nothing_new_in_its_description():
    assert set(paper_arena().to_dict()) == {"name", "walls", "grid", "start"}
    assert load_arena("paper") == paper_arena()
    assert load_arena("paper-boxes").grid == paper_arena().grid


def test_mazes_have_their_published_numbers():
    medium, hard = load_arena("maze-medium"), load_arena("maze-hard")
    assert (len(medium.walls), len(hard.walls)) == (4 + 7, 4 + 7)
    assert medium.start == pytest.approx((0.30, 0.22, 0))
    assert (medium.goal.x, medium.goal.y) == pytest.approx((2.70, 1.00))
    assert hard.start == pytest.approx((0.36, 1.84, 0))
    assert (hard.goal.x, hard.goal.y, hard.goal.radius) == pytest.approx((0.31, 0.20, 0.05))
    assert medium.walls[4] == pytest.approx((2.41, 1.35, 0.58, 0.65))
    assert hard.walls[-1] == pytest.approx((0.56, 0.55, 1.33, 0.30))


def test_unit_scales_lengths_and_nothing_else(write):
    text = """
unit = "cm"
wall = [[0, 0, 200, 0], [200, 0, 200, 100], [200, 100, 0, 100], [0, 100, 0, 0]]
start = [50, { uniform = [40, 60] }, 1.5]
goal = [150, 50, 5]
[[obstacle]]
x = 100
y = 50
heading_deg = 90
box = [20, 10]
radius = 2
[[light]]
x = 100
y = 90
strength = 3
[floor]
tape = [[0, 50, 100, 50]]
tape_width = 2
"""
    arena = load_arena(write(text))
    assert arena.walls[1] == pytest.approx((2, 0, 2, 1))
    assert arena.start == pytest.approx((0.5, 0.5, 1.5))
    assert arena.vary["arena.start.y"].uniform == pytest.approx((0.4, 0.6))
    (box,) = arena.obstacles
    assert box.heading == pytest.approx(math.pi / 2)
    assert np.ptp(box.outline(), axis=0) == pytest.approx([0.10, 0.20])
    assert arena.lights[0].strength == 3
    assert arena.floor.tape_width == pytest.approx(0.02)
    assert arena.floor.brightness(0.5, 0.505) == 0.0
    assert arena.floor.brightness(0.5, 0.52) == 1.0


def test_a_heading_is_in_radians_whatever_the_unit_of_a_start(write):
    """It was scaled like a length: 0.5 rad became 0.0127 rad."""
    arena = load_arena(write("wall_in = [[0, 0, 10, 0]]\nstart_in = [1, 2, 0.5]"))
    assert arena.start == pytest.approx((0.0254, 0.0508, 0.5))


def test_numbers_have_dotted_names_and_may_be_drawn(write):
    arena = load_arena(
        write(ROOM + "[[obstacle]]\nx = 1\ny = 0.5\nradius = 0.1\n[[light]]\nx = 1\ny = 0.9\n")
    )
    numbers = arena.numbers()
    assert numbers["arena.wall.1.y2"] == 1.0
    assert numbers["arena.obstacle.0.radius"] == 0.1
    moved = arena.with_numbers({"arena.obstacle.0.x": {"uniform": [0.9, 1.4]}, "arena.light.0.strength": 2.0})
    assert moved.numbers()["arena.obstacle.0.x"] == Distribution(uniform=(0.9, 1.4))
    assert moved.obstacles[0].x == pytest.approx(1.15)
    assert moved.lights[0].strength == 2.0
    assert Arena.from_dict(moved.to_dict()) == moved
    with pytest.raises(ValueError, match=r"Did you mean 'obstacle\.0\.radius'"):
        arena.with_numbers({"arena.obstacle.0.radios": 1.0})
    with pytest.raises(ValueError, match=r"begins with 'arena\.'"):
        arena.with_numbers({"drive.speed": 1.0})


@pytest.mark.parametrize(
    ("new", "says"),
    [
        ("walls", None),
        ("wall = [[0, 0, 1]]\nstart = [0, 0, 0]", "wall.0: expected [x1, y1, x2, y2], got [0, 0, 1]."),
        ("wall = [[0, 0, 1, nan]]\nstart = [0, 0, 0]", "wall.0.y2: expected a finite number"),
        ("start = [0, 0]", "start: expected [x, y, heading], got [0, 0]."),
        ("wall = [[1, 1, 1, 1]]\nstart = [0, 0, 0]", "wall.0: it begins where it ends."),
        ("wall = [[0, 0, 1e308, 0]]\nstart = [0, 0, 0]", "wall.0.x2: expected at most 10000 m, got 1e+308"),
        (ROOM + "[[light]]\nx_deg = 1\ny = 2", "light.0.x_deg: x is no angle"),
        (ROOM + "[[obstacle]]\nradius = 0.1\nheading_mm = 90", "obstacle.0.heading_mm: heading is an angle"),
        ("wall = []", "start: missing"),
        ("start = 'corner'\nwall = 3", "wall: expected a list, got 3."),
        (ROOM + "unit = 'ft'", "unit: expected 'm', 'cm', 'mm', 'in' or a length in meters, got 'ft'"),
        (ROOM + "unit = -1", "unit: expected"),
        (ROOM + "unit = 'cm'\n[[light]]\nx_mm = 1\ny = 2", "x_mm: the file has unit = 'cm' for all lengths"),
        (ROOM + "[[obstacle]]\nbox = [-1, 1]", "obstacle.0: expected box = [length, width]"),
        (ROOM + "[[obstacle]]\nx = 1", "obstacle.0: expected a radius of more than 0"),
        (ROOM + "[[obstacle]]\nx = 0.5\ny = 0.5\nradius = 0.1", "start: lies within obstacle 0"),
        (ROOM + "[[obstacle]]\ncorner = [[0, 0], [1, 0], [0.1, 0.1], [0, 1]]", "it is not convex: corner 2"),
        (ROOM + "[[light]]\nx = 0\ny = 0\nstrength = -1", "light.0.strength: expected at least 0"),
        (ROOM + "[grid]\nx = 0\ny = 0\ncell = 0.1\ncolumns = 20\nrows = 20", "expected at most 256 cells"),
        (ROOM + "[grid]\nx = 0\ny = 0\ncell = 0\ncolumns = 2\nrows = 2", "grid.cell: expected more than 0"),
        (ROOM + "goal = [1, 1, 0]", "goal.radius: expected more than 0"),
        (ROOM + "[floor.image]\nfile = 'none.png'\nwidth = 1", "none.png. Copy it there"),
    ],
)
def test_a_mistake_gets_its_place_and_our_words(write, new, says):
    file = write(ROOM.replace("wall =", "wals =") if says is None else new)
    with pytest.raises(DescriptionError) as caught:
        load_arena(file)
    assert (says or "wals: unknown setting. Did you mean 'wall'?") in str(caught.value)


def test_words_of_the_first_scene_files_are_still_read(write):
    old = load_arena(
        write("walls = [[0, 0, 2, 0]]\nlamps = [[1, 1, 3]]\ntape = [[0, 0, 1, 0]]\nstart = 'corner'\n")
    )
    new = load_arena(
        write(
            "wall = [[0, 0, 2, 0]]\nstart = [0.1905, 0.1905, 0]\n[[light]]\nx = 1\ny = 1\nstrength = 3\n"
            "[floor]\ntape = [[0, 0, 1, 0]]\n"
        )
    )
    assert old == new


def test_a_floor_image_is_kept_with_the_arena(write, tmp_path):
    gray = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20
    Image.fromarray(gray).save(tmp_path / "floor.png")
    arena = load_arena(write(ROOM + "[floor.image]\nfile = 'floor.png'\nwidth = 0.8\nx = 0.1\ny = 0.2\n"))
    (tmp_path / "floor.png").unlink()
    again = Arena.from_dict(json.loads(json.dumps(arena.to_dict())))
    assert (again.floor.image.gray == gray).all()
    assert again.floor.image.height == pytest.approx(0.6)
    assert again.floor.brightness(0.15, 0.75) == 0.0, "the upper left pixel"
    assert again.floor.brightness(5.0, 0.0) == pytest.approx(220 / 255), "beyond the image as at its edge"


def test_a_large_floor_image_is_refused(write, tmp_path):
    Image.new("L", (600, 10)).save(tmp_path / "floor.png")
    with pytest.raises(DescriptionError, match="600 x 10 pixels, expected at most 512"):
        load_arena(write(ROOM + "[floor.image]\nfile = 'floor.png'\nwidth = 0.8\n"))


# the start


def test_inner_walls_do_not_change_what_is_inside():
    maze = load_arena("maze-hard")
    xs, ys = np.meshgrid(np.linspace(0.06, 1.99, 40), np.linspace(0.06, 1.99, 40))
    assert all(is_inside(maze, x, y) for x, y in zip(xs.ravel(), ys.ravel(), strict=True))
    assert not is_inside(maze, 2.01, 1.0)


@pytest.mark.parametrize(
    ("pose", "says"),
    [
        (Pose(0.55, 0.15, 0.0), None),
        (Pose(0.05, 0.3, 0.0), "beyond a wall"),
        (Pose(16.5 * 0.0254, 0.3, 0.0), "overlap obstacle 0"),
        (Pose(29.5 * 0.0254 - 0.15, 9 * 0.0254, 0.0), "overlap obstacle 1"),
    ],
)
def test_a_start_that_does_not_fit_is_refused(pose, says):
    boxes = load_arena("paper-boxes")
    arena = Arena(boxes.name, boxes.walls, boxes.grid, pose, boxes.obstacles)
    if says is None:
        check_start(arena, load_robot("scribbler-s2-fluke2"))
        return
    with pytest.raises(ValueError, match=says):
        check_start(arena, load_robot("scribbler-s2-fluke2"))


def test_a_wall_through_the_body_is_refused():
    room = load_arena("goal")
    with pytest.raises(ValueError, match="overlap wall 4"):
        check_start(Arena("x", room.walls, room.grid, Pose(0.75, 0.32, 0.0)), load_robot("jyro"))


# obstacles

SHAPES = [
    Obstacle(0.3, -0.2, 0.7, ((0.1, 0.05), (-0.1, 0.05), (-0.1, -0.05), (0.1, -0.05)), 0.03),
    Obstacle(0.1, 0.1, 2.0, ((0.0, 0.0),), 0.2),
    Obstacle(0.0, 0.0, 1.0, ((0.1, 0.0), (-0.1, 0.0)), 0.05),
    Obstacle(0.0, 0.0, 0.3, ((0.1, 0.0), (0.0, 0.1), (-0.1, 0.0)), 0.0),
]


@pytest.mark.parametrize("obstacle", SHAPES)
def test_distance_to_an_obstacle_is_0_on_its_outline_and_grows_outwards(obstacle):
    outline = np.array(obstacle.outline(step=0.01))
    assert max(abs(obstacle.distance(x, y)) for x, y in outline) < 1e-12
    middle = outline.mean(0)
    for x, y in outline:
        out_x, out_y = middle + 1.5 * ((x, y) - middle)
        in_x, in_y = middle + 0.5 * ((x, y) - middle)
        assert obstacle.distance(out_x, out_y) > 0 > obstacle.distance(in_x, in_y)


@pytest.mark.parametrize("obstacle", SHAPES)
def test_sides_of_an_obstacle_lie_on_its_outline(obstacle):
    for x1, y1, x2, y2 in obstacle.edges():
        for share in (0.0, 0.3, 1.0):
            assert obstacle.distance(x1 + share * (x2 - x1), y1 + share * (y2 - y1)) == pytest.approx(
                0, abs=1e-12
            )


# in studies


def test_conditions_in_the_paper_s_arena_say_what_they_said_before_there_were_files():
    assert Condition(name="a").settings()["arena"] == {"preset": "paper", "start": "corner"}


def test_a_study_names_a_file_beside_it_and_its_results_hold_the_arena(write, tmp_path):
    write(ROOM)
    study = write(
        '[study]\nname = "x"\n[arena]\nfile = "room.toml"\n[[condition]]\nname = "a"\n', "study.toml"
    )
    (condition,) = load_study(study).conditions
    arena = condition.arena.arena()
    assert arena == load_arena(tmp_path / "room.toml")
    kept = json.loads(json.dumps(condition.settings()))
    assert kept["arena"]["file"] == "room.toml", "no folder, which differs between machines"
    before = condition.hash()
    write(ROOM.replace("start = [0.5", "start = [0.6"))
    assert load_study(study).conditions[0].hash() != before
    (tmp_path / "room.toml").unlink()
    assert Condition.from_settings("a", kept).arena.arena() == arena
    assert Condition.from_settings("a", kept).hash() == before


def test_arenas_by_name_begin_where_their_files_say_unless_a_study_does():
    assert ArenaSettings(preset="goal").arena() == load_arena("goal")
    moved = ArenaSettings(preset="goal", start=[0.3, 0.2, 1.0]).arena()
    assert moved.start == (0.3, 0.2, 1.0)
    assert moved.walls == load_arena("goal").walls


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"preset": "papr"}, "ArenaSettings.preset: expected avoid, goal, "),
        (
            {"preset": "goal", "start": "left"},
            "ArenaSettings.start: is only for the paper's arena. Remove it",
        ),
        ({"file": "none.toml"}, "ArenaSettings.file: There is no arena file none.toml."),
        ({"preset": "goal", "file": "none.toml"}, "no arena file"),
        ({"start": [5.0, 0.1, 0.0]}, "start lies outside the arena: expected 0 < x < 1.0668"),
        ({"start": [0.5, 0.3, 90.0]}, "heading is in radians"),
        ({"file": 3}, "ArenaSettings.file: expected a text in quotes"),
    ],
)
def test_settings_of_an_arena_tell_their_mistakes(values, says):
    with pytest.raises(ValueError, match="ArenaSettings") as caught:
        ArenaSettings(**values)
    assert says in str(caught.value)


def test_jyro_says_what_it_cannot_do():
    with pytest.raises(ValueError, match="has round obstacles"):
        Condition(name="a", arena={"preset": "light"})
    assert len(load_arena("paper-boxes").straight_walls()) == 4 + 2 * 4
    drawn = load_arena("goal").with_numbers({"arena.start.x": {"uniform": [0.2, 0.3]}})
    with pytest.raises(ValueError, match=r"arena\.start\.x are drawn"):
        drawn.straight_walls()


NUMBER = st.one_of(st.floats(-5, 5), st.floats(), st.integers(-3, 3), st.text(max_size=2))
TABLE = st.dictionaries(
    st.sampled_from(
        ["x", "y", "heading_deg", "radius", "box", "corner", "strength", "cell", "columns", "rows"]
    ),
    st.one_of(NUMBER, st.lists(NUMBER, max_size=3), st.lists(st.lists(NUMBER, max_size=3), max_size=5)),
    max_size=5,
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.fixed_dictionaries(
        {"start": st.one_of(st.just([0.5, 0.5, 0.0]), st.lists(NUMBER, max_size=4))},
        optional={
            "wall": st.lists(st.lists(NUMBER, min_size=3, max_size=5), max_size=4),
            "obstacle": st.lists(TABLE, max_size=3),
            "light": st.lists(TABLE, max_size=2),
            "grid": TABLE,
            "goal": st.lists(NUMBER, max_size=4),
            "floor": st.dictionaries(st.sampled_from(["tape", "image"]), TABLE, max_size=2),
        },
    )
)
def test_whatever_values_come_there_is_an_arena_or_a_message(values):
    arena = made_or_told(lambda: Arena.from_file(ArenaFile(name="x", **values)))
    assert arena, "a mistake is told in words"
    if not isinstance(arena, str):
        assert Arena.from_dict(json.loads(json.dumps(arena.to_dict()))) == arena
