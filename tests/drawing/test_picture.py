"""Plain shapes as SVG."""

import xml.etree.ElementTree as ET

import pytest

from realitygap.drawing import Disc, Ink, Line, Picture, Text

SVG = "{http://www.w3.org/2000/svg}"


def picture(*shapes, **changes):
    values = {
        "title": "A title",
        "description": "What is there.",
        "left": 0,
        "bottom": 0,
        "right": 2,
        "top": 1,
    }
    return Picture(**values | changes, shapes=shapes)


def test_a_picture_says_what_it_is():
    root = ET.fromstring(picture().to_svg())
    assert root.find(f"{SVG}title").text == "A title"
    assert root.find(f"{SVG}desc").text == root.get("aria-label") == "What is there."
    assert root.get("role") == "img"


def test_up_is_up_and_one_unit_is_as_long_across_as_up():
    root = ET.fromstring(picture(Line(((0, 0), (2, 1))), Disc(1.0, 0.25, 3)).to_svg(200))
    assert (root.get("width"), root.get("height")) == ("200pt", "100pt")
    assert root.find(f"{SVG}path").get("d") == "M0 100L200 0"
    circle = root.find(f"{SVG}circle")
    assert (circle.get("cx"), circle.get("cy"), circle.get("r")) == ("100", "75", "3")


def test_lines_can_be_closed_filled_and_dashed():
    root = ET.fromstring(picture(Line(((0, 0), (1, 0), (1, 1)), None, 2, (3, 1), True, Ink.BAND)).to_svg())
    path = root.find(f"{SVG}path")
    assert path.get("d").endswith("Z")
    assert path.get("fill") == Ink.BAND
    assert path.get("stroke") is None
    dashed = ET.fromstring(picture(Line(((0, 0), (1, 0)), Ink.OURS, 2, (3, 1))).to_svg()).find(f"{SVG}path")
    assert (dashed.get("stroke"), dashed.get("stroke-dasharray")) == (Ink.OURS, "3 1")


def test_hostile_text_stays_text():
    evil = "<script>\"'& \x07 \ud800"
    root = ET.fromstring(picture(Text(0, 0, evil), title=evil, description=evil).to_svg())
    assert root.find(f"{SVG}text").text == "<script>\"'& \ufffd \ufffd"
    assert not [each for each in root.iter() if each.tag.endswith("script")]


def test_shapes_keep_their_order():
    root = ET.fromstring(picture(Disc(0, 0, 1), Line(((0, 0), (1, 1))), Text(0, 0, "a")).to_svg())
    assert [each.tag.removeprefix(SVG) for each in root][3:] == ["circle", "path", "text"]


def test_an_empty_rectangle_is_refused():
    with pytest.raises(ValueError, match="expected more than 0"):
        picture(right=0).to_svg()


def test_inks_are_all_different():
    colors = list(Ink.names().values())
    assert len(set(colors)) == len(colors)
    assert [name for name in Ink.names() if name.startswith("pen")] == [f"pen{k}" for k in range(8)]


def test_notebooks_show_it():
    assert picture()._repr_svg_() == picture().to_svg()
