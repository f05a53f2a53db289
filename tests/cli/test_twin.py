"""`realitygap twin` as a user meets it."""

import json
from functools import partial

import pytest

from realitygap.errors import RealityGapError
from realitygap.robots.twin import FAMILIES, family_rows, load_twin, sample_twin

from .invoked import printed, refused

pytestmark = pytest.mark.slow


twin = partial(printed, "twin")


def test_sample_prints_a_twin_or_writes_it(tmp_path):
    printed = twin("sample", "--family", "worn", "--seed", "3")
    file = tmp_path / "worn-3.toml"
    assert twin("sample", "--family", "worn", "--seed", "3", "-o", file) == f"Written: {file}\n"
    assert file.read_text("utf-8") == printed
    assert load_twin(file) == sample_twin("worn", 3)


def test_families_are_listed_with_what_each_draws():
    listed = twin("families").splitlines()
    assert [line.split()[0] for line in listed] == ["family", *FAMILIES]
    drawn = json.loads(twin("families", "slippery", "--json"))
    assert drawn == [row._asdict() for row in family_rows("slippery")]
    assert {"number": "wheels.friction", "low": 0.12, "high": 0.3, "part": "slippery"} in drawn
    assert "motors.gain_left" in twin("families", "every")
    assert twin("families", "close") == "close draws what every twin does: realitygap twin families every\n"


def test_a_twin_is_drawn(tmp_path):
    file = tmp_path / "a.toml"
    twin("sample", "--family", "odd-body", "-o", file)
    svg = tmp_path / "a.svg"
    twin("show", file, "-o", svg)
    assert "odd-body-0 (TWIN)" in svg.read_text("utf-8")
    with pytest.raises(RealityGapError, match=r"ends in \.gif, expected"):
        twin("show", file, "-o", tmp_path / "a.gif")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["sample", "--family", "wron"], "Did you mean 'worn'"),
        (["families", "wron"], "Did you mean 'worn'"),
        (["show", "none.toml", "-o", "a.svg"], "There is no twin file none.toml"),
        (["render", "none.toml", "-o", "a.gif"], "There is no twin file none.toml"),
    ],
)
def test_mistakes_are_one_message(words, said):
    with pytest.raises(RealityGapError, match=said):
        twin(*words)


def test_the_emulator_refuses_a_twin_that_it_cannot_move(tmp_path):
    file = tmp_path / "same.toml"
    twin("sample", "--family", "same", "-o", file)
    for path, said in ((file, "engine 'sim'"), (tmp_path / "none.toml", "There is no twin file")):
        assert said in refused("emulate", "scribbler", "--twin", path)


def test_render_refuses_wrong_options(tmp_path):
    file = tmp_path / "a.toml"
    twin("sample", "--family", "close", "-o", file)
    for options, said in (
        (["-o", "a.avi"], r"ends in \.avi"),
        (["-o", "a.gif", "--view", "abov"], "Did you mean 'above'"),
        (["-o", "a.png", "--view", "above"], r"expected \.gif or \.mp4"),
        (["-o", "a.gif", "--speed", "0"], "speed is 0"),
        (["-o", "a.gif", "--arena", "moon"], "Unknown arena 'moon'"),
    ):
        with pytest.raises(RealityGapError, match=said):
            twin("render", file, *options)
