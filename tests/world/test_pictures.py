"""What robots and arenas look like: everything that is there is drawn, to scale and in its place."""

import math

import numpy as np
import pytest

from realitygap.drawing import Disc, Ink, Line, Text
from realitygap.world import (
    Arena,
    Floor,
    FloorImage,
    arena_names,
    arena_picture,
    load_arena,
    load_robot,
    model_picture,
    robot_names,
)


def texts(picture):
    return [shape.text for shape in picture.shapes if isinstance(shape, Text)]


def points_of(shape):
    return shape.points if isinstance(shape, Line) else ((shape.x, shape.y),)


@pytest.mark.parametrize("name", robot_names())
def test_a_robot_s_picture_has_its_outline_sensors_size_and_sources(name):
    robot = load_robot(name)
    picture = model_picture(robot)
    outlines = [
        shape.points for shape in picture.shapes if isinstance(shape, Line) and shape.color == Ink.BODY
    ]
    assert outlines == [part.outline() for part in robot.body]
    mounts = {
        (s.x, s.y)
        for s in picture.shapes
        if isinstance(s, Disc) and s.fill == Ink.PUBLISHED and s.radius == 2
    }
    assert mounts == {(sensor.x, sensor.y) for sensor in robot.range}
    told = " ".join(texts(picture))
    for source in robot.sources:
        assert source.split(":")[0] in told
    assert robot.name in texts(picture)
    for shape in picture.shapes:
        for x, y in points_of(shape):
            assert picture.left <= x <= picture.right
            assert picture.bottom <= y <= picture.top
    assert picture.to_svg().startswith("<svg")


def test_a_cone_is_as_wide_and_as_long_as_the_sensor_sees():
    robot = load_robot("jyro").with_numbers({"range.0.cone": 0.3, "range.0.reach": 0.1})
    cones = [s.points for s in model_picture(robot).shapes if isinstance(s, Line) and s.fill == "#f3d9c6"]
    (cone,) = cones
    angles = [math.atan2(y - 0.05, x - 0.09) for x, y in cone[1:]]
    assert (min(angles), max(angles)) == pytest.approx((-0.3, 0.3))
    assert [math.dist((0.09, 0.05), point) for point in cone[1:]] == pytest.approx([0.1] * (len(cone) - 1))


def test_a_robot_that_drives_to_its_back_has_its_arrow_there():
    robot = load_robot("scribbler-s2")
    backwards = type(robot).from_dict(robot.to_dict() | {"drive": robot.to_dict()["drive"] | {"ahead": -1}})
    for model, sign in ((robot, 1), (backwards, -1)):
        arrow = next(
            s for s in model_picture(model).shapes if isinstance(s, Line) and s.points[0] == (0.0, 0.0)
        )
        assert math.copysign(1, arrow.points[1][0]) == sign


@pytest.mark.parametrize("name", arena_names())
def test_an_arena_s_picture_has_everything_in_it(name):
    arena = load_arena(name)
    picture = arena_picture(arena, load_robot("khepera"))
    lines = [shape.points for shape in picture.shapes if isinstance(shape, Line)]
    for x1, y1, x2, y2 in arena.walls:
        assert ((x1, y1), (x2, y2)) in lines
    for obstacle in arena.obstacles:
        assert obstacle.outline() in lines
    assert ("goal" in texts(picture)) is (arena.goal is not None)
    assert sum(text.startswith("light ") for text in texts(picture)) == len(arena.lights)
    for shape in picture.shapes:
        for x, y in points_of(shape):
            assert picture.left <= x <= picture.right
            assert picture.bottom <= y <= picture.top


def test_a_floor_image_is_drawn_with_its_first_row_on_top():
    image = FloorImage.of(0.2, 0.1, 0.4, np.array([[0, 255], [255, 255]], np.uint8))
    paper = load_arena("paper")
    arena = Arena("x", paper.walls, paper.grid, paper.start, floor=Floor(image=image))
    dark = [s.points for s in arena_picture(arena).shapes if isinstance(s, Line) and s.fill == "#1f1f1f"]
    (corners,) = dark
    for corner, expected in zip(corners, ((0.2, 0.3), (0.4, 0.3), (0.4, 0.5), (0.2, 0.5)), strict=True):
        assert corner == pytest.approx(expected)
    assert arena.floor.brightness(0.3, 0.4) == 0.0
