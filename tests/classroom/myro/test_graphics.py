"""Windows and shapes, and how they and pictures are shown."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from realitygap.classroom import myro
from realitygap.classroom.myro import (
    Circle,
    GraphWin,
    Image,
    Line,
    MyroError,
    Oval,
    Point,
    Polygon,
    Rectangle,
    Text,
    _show,
)


@pytest.fixture(autouse=True)
def no_leftovers(monkeypatch, tmp_path):
    monkeypatch.setattr(_show, "_folder", tmp_path)
    monkeypatch.setattr(_show, "_opened", set())


def shapes(window):
    return [element.tag.rpartition("}")[2] for element in ElementTree.fromstring(window.to_svg())][1:]


def test_every_shape_is_drawn_moved_colored_and_taken_out():
    window = GraphWin("Shapes", 100, 80)
    drawn = [
        Point(1, 2),
        Line(Point(0, 0), Point(10, 10)),
        Rectangle(Point(0, 0), Point(20, 10)),
        Oval(Point(0, 0), Point(20, 10)),
        Circle(Point(50, 50), 5),
        Polygon(Point(0, 0), Point(5, 0), Point(5, 5)),
        Text(Point(50, 20), "a < b"),
        Image(Point(20, 20), myro.makePicture(4, 4, myro.red)),
    ]
    for shape in drawn:
        shape.draw(window)
        shape.setFill("red")
        shape.setOutline(myro.makeColor(0, 0, 255))
        shape.setWidth(3)
        shape.move(1, 1)
    assert shapes(window) == ["rect", "line", "rect", "ellipse", "ellipse", "polygon", "text", "image"]
    myro.undraw(drawn[0])
    assert shapes(window)[0] == "line"
    assert drawn[4].getCenter().getX() == 51
    assert (drawn[4].getP1().x, drawn[4].getP2().y, drawn[4].getRadius()) == (46, 56, 5)


def test_a_line_has_arrows_at_the_ends_that_were_asked_for():
    line = Line(Point(0, 0), Point(50, 0))
    line.draw(GraphWin("Arrows"))
    for option, tips in (("none", 0), ("first", 1), ("last", 1), ("both", 2)):
        line.setArrow(option)
        assert line.window.to_svg().count("<polygon") == tips
    line.setArrow("last")
    assert 'points="50,0 ' in line.window.to_svg()


def test_a_clone_is_not_drawn_and_moves_by_itself():
    window = GraphWin("Clones")
    line = Line(Point(0, 0), Point(1, 1))
    myro.draw(line)
    other = line.clone()
    other.move(5, 5)
    assert line.getP1().x == 0
    assert len(window.items) == 1
    other.draw(window)
    assert len(window.items) == 2


def test_coordinates_may_run_upwards():
    window = GraphWin("Coordinates", 100, 100)
    assert window.toScreen(10, 10) == (10, 10)
    window.setCoords(0, 0, 1, 1)
    assert window.toScreen(0.25, 0.25) == (25, 75)


def test_windows_are_found_by_title_and_the_newest_without():
    first, second = GraphWin("One"), GraphWin("Two")
    assert myro.getWindow("One") is first
    assert myro.getWindow() is second
    with pytest.raises(MyroError, match="no window 'Three' yet"):
        myro.getWindow("Three")


def test_a_click_is_asked_for(monkeypatch):
    given = ["here", "3 4"]
    monkeypatch.setattr("builtins.input", lambda prompt="": given.pop(0))
    point = GraphWin("Click").getMouse()
    assert (point.getX(), point.getY()) == (3, 4)


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: Circle((1, 2), 3), "expected a Point"),
        (lambda: Line(Point(0, 0), Point(1, 1)).setFill("no color!"), "The color is"),
        (lambda: Polygon(Point(0, 0), Point(1, 1)), "three or more"),
        (lambda: GraphWin("A", 0, 5), "width"),
        (lambda: Point("a", 1), "Point: x"),
        (lambda: Text(Point(0, 0), "a").setStyle("fat"), "setStyle"),
        (lambda: Text(Point(0, 0), "a").setFace("comic"), "setFace"),
        (lambda: GraphWin("A").setCoords(0, 0, 0, 1), "span an area"),
        (lambda: Line(Point(0, 0), Point(1, 1)).setArrow("up"), "setArrow"),
    ],
)
def test_mistakes_with_shapes_are_said_plainly(act, message):
    with pytest.raises(MyroError, match=message):
        act()


def test_drawing_twice_or_into_a_closed_window_is_refused():
    window = GraphWin("Once")
    point = Point(1, 1)
    point.draw(window)
    with pytest.raises(MyroError, match="drawn already"):
        point.draw(window)
    window.close()
    assert window.isClosed()
    with pytest.raises(MyroError, match="was closed"):
        Point(2, 2).draw(window)


def test_distance_is_the_length_of_a_straight_line():
    assert myro.distance((0, 0), (3, 4)) == 5


def test_a_picture_is_written_as_a_page_and_repainted(capsys, tmp_path):
    picture = myro.makePicture(4, 2, myro.red)
    myro.show(picture, "mine")
    myro.show(picture, "mine")
    (page,) = re.findall(r"is shown in (.*)", capsys.readouterr().out)  # said once
    before = Path(page).read_text()
    assert 'width="250"' in before
    myro.setRGB(myro.getPixel(picture, 0, 0), (0, 0, 255))
    myro.repaint(name="mine")
    assert Path(page).read_text() != before
    with pytest.raises(MyroError, match="nothing was shown as 'other'"):
        myro.repaint(name="other")
    with pytest.raises(MyroError, match="expected one made by takePicture"):
        myro.show("picture.jpg")
