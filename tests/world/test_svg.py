"""Arenas drawn in SVG."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.errors import DescriptionError
from realitygap.world import load_arena
from realitygap.world._svg import svg_values

from .outcomes import made_or_told

FRAME = '<svg xmlns="http://www.w3.org/2000/svg" width="80cm" height="500mm" viewBox="0 0 800 500">{}</svg>'
START = '<line id="start" x1="100" y1="400" x2="100" y2="300"/>'


@pytest.fixture(name="arena_of")
def _arena_of(tmp_path):
    def arena_of(shapes, frame=FRAME):
        file = tmp_path / "drawn.svg"
        file.write_text(frame.format(shapes) if "{}" in frame else frame)
        return load_arena(file)

    return arena_of


def test_y_grows_upwards_and_a_line_is_where_the_robot_looks(arena_of):
    arena = arena_of(START + '<line x1="0" y1="500" x2="800" y2="500"/>')
    assert arena.start == pytest.approx((0.1, 0.1, math.pi / 2))
    assert arena.walls == ((0.0, 0.0, 0.8, 0.0),)
    assert arena.name == "drawn"


def test_outlines_become_walls_and_filled_shapes_obstacles(arena_of):
    arena = arena_of(
        START
        + '<rect width="800" height="500" fill="none"/>'
        + '<g style="fill: none"><polygon points="0,0 10,0 0,10"/></g>'
        + '<rect x="300" y="100" width="100" height="40" rx="10"/>'
        + '<circle cx="600" cy="250" r="50"/>'
        + '<path d="m 500 400 h 40 v 40 z"/>'
    )
    assert len(arena.walls) == 4 + 3
    box, disc, triangle = arena.obstacles
    assert (box.x, box.y, box.radius) == pytest.approx((0.35, 0.38, 0.01))
    assert max(x for x, _ in box.outline()) == pytest.approx(0.4)
    assert (disc.x, disc.y, disc.radius, disc.corners) == (pytest.approx(0.6), 0.25, 0.05, ((0.0, 0.0),))
    assert len(triangle.corners) == 3


@pytest.mark.parametrize(
    "marked",
    ['id="light2"', 'class="big light"', 'data-kind="light"'],
)
def test_lights_goal_and_tape_are_marked(arena_of, marked):
    arena = arena_of(
        START
        + f'<circle {marked} cx="400" cy="250" r="3" data-strength="0.5"/>'
        + '<circle id="goal" cx="700" cy="100" r="40"/>'
        + '<g data-kind="tape"><polyline points="0,250 400,250 400,0"/></g>'
        + '<text data-kind="ignore">a room</text>'
    )
    (light,) = arena.lights
    assert (light.x, light.y, light.strength) == pytest.approx((0.4, 0.25, 0.5))
    assert (arena.goal.x, arena.goal.y, arena.goal.radius) == pytest.approx((0.7, 0.4, 0.04))
    assert len(arena.floor.tape) == 2
    assert not arena.walls


def test_transforms_move_turn_and_scale(arena_of):
    arena = arena_of(
        START
        + '<g transform="translate(400 250)"><rect transform="rotate(90) scale(2)" width="50" height="20"/></g>'
    )
    xs, ys = zip(*arena.obstacles[0].outline(), strict=True)
    assert (min(xs), max(xs), min(ys), max(ys)) == pytest.approx((0.36, 0.4, 0.15, 0.25))


def test_the_scale_may_be_stated(arena_of):
    frame = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 8 5" data-meters-per-unit="0.1">{}</svg>'
    arena = arena_of('<line x1="0" y1="0" x2="8" y2="0"/><circle id="start" cx="1" cy="1" r="1"/>', frame)
    assert arena.walls == (pytest.approx((0, 0.5, 0.8, 0.5)),)
    assert arena.start == pytest.approx((0.1, 0.4, 0.0))


@pytest.mark.parametrize(
    ("shapes", "says"),
    [
        ("", "start: missing"),
        ('<text id="note">x</text>', "<text id='note'>: cannot be used"),
        ('<ellipse rx="1" ry="2"/>', "<ellipse>: cannot be used"),
        ('<path id="arc" d="M 0 0 C 1 1 2 2 3 3"/>', "<path id='arc'>: has a curve (C)"),
        ('<path d="M 0 0 L 1 1 M 2 2 L 3 3"/>', "has several pieces"),
        ('<path d="L"/>', "less than two points"),
        ('<path d="M 1"/>', "expected M x y"),
        ('<rect width="-1" height="2"/>', "is -1 wide and 2 high"),
        ('<rect width="wide" height="2"/>', "width is 'wide', expected a number"),
        ('<rect width="10" height="20" rx="1" ry="2"/>', "corners are round"),
        ('<circle r="0"/>', "r is 0, expected more than 0"),
        ('<circle r="1e999"/>', "r is '1e999', expected a number"),
        ('<circle r="1" transform="scale(2 1)"/>', "drawn larger one way"),
        ('<rect width="1" height="1" transform="skewX(3)"/>', "transform skewX(3) cannot be used"),
        ('<polygon points="0,0 100,0 20,20 0,100"/>', "it is not convex: corner"),
        ('<polygon points="0,0 1"/>', "has 3 numbers in points"),
        ('<rect id="goal" width="3" height="3"/>', "marks the goal, expected a circle"),
        ('<circle id="start2" r="1"/>', "marks a second start"),
        ('<circle class="light" r="1" data-strength="big"/>', "data-strength is 'big'"),
        ('<rect rx="3" width="9" height="9" fill="none"/>', "has round corners, which only obstacles have"),
    ],
)
def test_shapes_that_cannot_be_used_are_refused_by_name(arena_of, shapes, says):
    with pytest.raises(DescriptionError) as caught:
        arena_of(shapes + (START if says != "start: missing" else ""))
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("<svg", "it is not SVG"),
        ("<html/>", "expected <svg>, got <html>"),
        ('<svg viewBox="0 0 1 1"/>', "width: expected a length such as 800mm"),
        ('<svg width="100px" viewBox="0 0 1 1"/>', "got '100px'"),
        ('<svg width="100mm"/>', "viewBox: expected four numbers"),
        ('<svg width="100mm" viewBox="0 0 0 1"/>', "viewBox: expected four numbers"),
        ('<svg width="100mm" height="1mm" viewBox="0 0 1 1"/>', "do not fit the viewBox"),
        (
            '<svg viewBox="0 0 1 1" data-meters-per-unit="-1"/>',
            "data-meters-per-unit: expected a number above 0",
        ),
        ('<!DOCTYPE svg [<!ENTITY a "aaaa">]><svg>&a;</svg>', "declares entities"),
        ("<!DOCTYPE svg [\n<!ELEMENT a EMPTY>]><svg/>", "declares entities"),
    ],
)
def test_a_drawing_without_size_or_with_entities_is_refused(arena_of, text, says):
    with pytest.raises(DescriptionError) as caught:
        arena_of("", text)
    assert says in str(caught.value)


def test_groups_may_not_lie_deep_in_each_other(arena_of):
    with pytest.raises(DescriptionError, match="deep in each other"):
        arena_of("<g>" * 100 + "</g>" * 100)


def test_many_shapes_are_refused(arena_of):
    with pytest.raises(DescriptionError, match="more than 5000 shapes"):
        arena_of('<line x2="1"/>' * 5001)


ATTRIBUTE = st.sampled_from(
    ["x", "y", "width", "height", "r", "cx", "rx", "points", "d", "id", "class", "transform", "style", "fill"]
)
VALUE = st.one_of(
    st.text(alphabet="MLHVZzlhv0123456789.,- e()", max_size=30),
    st.sampled_from(
        ["none", "start", "goal", "light", "tape", "rotate(30)", "translate(1", "1e308", "M0 0L1 1z"]
    ),
)
SHAPE = st.builds(
    lambda tag, values: f"<{tag} " + " ".join(f'{key}="{value}"' for key, value in values.items()) + "/>",
    st.sampled_from(["rect", "line", "circle", "polyline", "polygon", "path", "g", "text"]),
    st.dictionaries(ATTRIBUTE, VALUE, max_size=6),
)


@settings(max_examples=300, deadline=None)
@given(st.lists(SHAPE, max_size=5))
def test_whatever_is_drawn_there_are_values_or_a_message(shapes):
    values = made_or_told(lambda: svg_values(FRAME.format("".join(shapes))))
    assert values, "a mistake is told in words"
    if not isinstance(values, str):
        assert len(values["start"]) == 3


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_no_svg_or_an_svg(text):
    with pytest.raises(ValueError, match=r"."):
        svg_values(text)
