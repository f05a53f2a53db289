"""Every example of the gallery runs, and draws the picture that the page shows."""

import importlib.util
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parent.parent / "docs"


def _make_gallery():
    if "make_gallery" not in sys.modules:
        spec = importlib.util.spec_from_file_location("make_gallery", DOCS / "make_gallery.py")
        sys.modules["make_gallery"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["make_gallery"])
    return sys.modules["make_gallery"]


gallery = _make_gallery()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("gallery")


LONG = {"light_seeking", "maze"}
"""Examples that evolve for tens of thousands of trials."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if name in LONG else ()) for name in gallery.names()]
)
def test_an_example_runs_and_draws_the_picture_of_the_page(name, folder, tmp_path):
    picture = tmp_path / gallery.picture_name(name)
    gallery.run(name, picture, folder)
    committed = gallery.PICTURES / picture.name
    assert gallery.difference(picture, committed) == ""
    assert committed.stat().st_size <= gallery.MOST_BYTES


def test_there_is_a_picture_of_each_example_and_no_other():
    assert len(gallery.names()) >= 8
    assert {path.name for path in gallery.PICTURES.iterdir()} == {
        gallery.picture_name(name) for name in gallery.names()
    }


def test_the_page_has_title_text_picture_and_code_of_each_example():
    page = gallery.page_part()
    assert (
        page.count("\n```{image} images/gallery/")
        == page.count("```{literalinclude}")
        == len(gallery.names())
    )
    assert page.startswith("## The paper's study in five lines\n\nNine conditions")


def test_pictures_that_differ_are_told_apart(tmp_path):
    one = tmp_path / "a.svg"
    one.write_text("<svg><text>coverage .3</text></svg>")
    other = tmp_path / "b.svg"
    other.write_text("<svg><text>coverage .4</text></svg>")
    assert "coverage .4" in gallery.difference(one, other)
    assert gallery.difference(one, one) == ""
    maze = gallery.PICTURES / "maze.png"
    assert gallery.difference(maze, maze) == ""
    assert "pictures of" in gallery.difference(maze, gallery.PICTURES / "novelty-archive.png")
