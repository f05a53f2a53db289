"""`realitygap show` as a user meets it."""

import xml.etree.ElementTree as ET
from functools import partial

import pytest
from PIL import Image

from realitygap.errors import RealityGapError
from realitygap.report import save_view

from .invoked import printed

show = partial(printed, "show")


@pytest.mark.parametrize("ending", ["svg", "pdf", "png"])
@pytest.mark.parametrize(
    "words",
    [
        ["DIR", "--condition", "coverage-50", "--replicate", "2"],
        ["DIR", "--condition", "novelty-50", "--generation", "1"],
        ["DIR", "--replicate", "0", "--generation", "1", "--individual", "3"],
        ["network", "DIR", "--condition", "novelty-50"],
        ["species", "DIR"],
        ["lineage", "DIR"],
        ["lineage", "DIR", "--condition", "novelty-50", "--generation", "1", "--individual", "2"],
        ["divergence", "DIR", "--against", "novelty-50", "--repeats", "3"],
        ["arena"],
        ["arena", "paper"],
        ["arena", "light", "--robot", "khepera"],
        ["robot", "jyro"],
        ["robot", "scribbler-s2-fluke2-cardboard"],
    ],
    ids=" ".join,
)
def test_everything_is_shown_in_every_format(results, tmp_path, words, ending):
    path = tmp_path / f"picture.{ending}"
    words = [results if word == "DIR" else word for word in words]
    assert show(*words, "-o", path) == f"Written: {path}\n"
    if ending == "png":
        with Image.open(path) as image:
            assert image.format == "PNG"
            assert image.size[0] >= 1000
    elif ending == "pdf":
        assert path.read_bytes().startswith(b"%PDF-")
    else:
        root = ET.parse(path).getroot()
        assert [each.tag.split("}")[1] for each in root][:2] == ["title", "desc"]
        ids = [each.get("id") for each in root.iter() if each.get("id")]
        assert len(set(ids)) == len(ids)
        if words[0] not in ("arena", "robot"):
            assert "SIM" in "".join(root.itertext())
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def test_a_trial_moves_for_as_long_as_it_lasted(results, tmp_path):
    path = tmp_path / "trial.gif"
    words = ["--condition", "novelty-50", "--replicate", "1", "--generation", "1", "--individual", "2"]
    show(results, *words, "-o", path)
    with Image.open(path) as image:
        assert image.format == "GIF"
        assert image.n_frames == 21, "the start and 20 steps"
        assert image.size == (720, 464)
        assert image.info["duration"] == 100
        assert image.info["comment"].endswith(b"novelty-50, run 1, generation 1, individual 2")


@pytest.mark.parametrize(
    ("words", "title", "names"),
    [
        (["--generation", "1"], "coverage-50, run 0, generation 1, individual 3", []),
        (["--each", "individual"], "coverage-50, run 0, generation 1", [f"individual {k}" for k in range(4)]),
        (
            ["--each", "generation"],
            "coverage-50, run 0: the best of each generation",
            ["generation 0", "generation 1", "generation 2"],
        ),
        (["--each", "condition"], "tiny: the best of each condition", ["coverage-50", "novelty-50"]),
    ],
)
def test_a_movie_shows_one_trial_or_several(results, tmp_path, monkeypatch, words, title, names):
    from realitygap.playback import _movie

    screens = []
    Screen = _movie.Screen
    monkeypatch.setattr(_movie, "Screen", lambda *args: screens.append(Screen(*args)) or screens[-1])
    path = tmp_path / "a.gif"
    assert show("movie", results, *words, "--speed", "10", "-o", path) == f"Written: {path}\n"
    (screen,) = screens
    assert screen._title == title or not names
    assert len(screen.trials) == max(len(names), 1)
    assert [trial.title for trial in screen.trials] == names or screen.trials[0].title.startswith(
        "coverage-50, run"
    )
    with Image.open(path) as image:
        assert image.info["comment"].startswith(b"realitygap: SIM, ")


def test_a_movie_of_two_studies_shows_a_trial_of_each(results, tmp_path):
    path = tmp_path / "a.gif"
    show("movie", results, results, "--speed", "20", "-o", path)
    with Image.open(path) as image:
        assert image.info["comment"] == b"realitygap: SIM, 2 studies"


def test_a_file_that_is_there_gives_way(results, tmp_path):
    path = tmp_path / "run.svg"
    path.write_text("old")
    show(results, "-o", path)
    assert path.read_text().startswith("<svg")
    assert [each.name for each in tmp_path.iterdir()] == ["run.svg"]


def test_mistakes_in_python_are_told_too(results, tmp_path):
    """An unknown subject was taken for a run, and drawn."""
    for changes, error, message in (
        ({"subject": "netwrk"}, ValueError, "Unknown subject 'netwrk'. Did you mean 'network'?"),
        ({"condition": ""}, ValueError, "Unknown condition ''"),
        ({"replicate": "1"}, TypeError, "replicate is '1', expected a whole number"),
        ({"generation": 0.5}, TypeError, "generation is 0.5, expected a whole number"),
        ({"generation": 0, "individual": "a"}, TypeError, "individual is 'a', expected a whole number"),
    ):
        with pytest.raises(error) as caught:
            save_view(results, tmp_path / "a.svg", **changes)
        assert message in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["DIR", "--condition", "coverage-5O", "-o", "a.svg"], "Did you mean 'coverage-50'?"),
        (["DIR", "--replicate", "99", "-o", "a.svg"], "its runs are 0 to 2"),
        (["DIR", "--replicate", "-1", "-o", "a.gif"], "its runs are 0 to 2"),
        (["DIR", "--generation", "9", "-o", "a.svg"], "its generations are 0 to 2"),
        (["DIR", "--individual", "1", "-o", "a.svg"], "of which generation?"),
        (["DIR", "--generation", "1", "--individual", "4", "-o", "a.svg"], "its individuals are 0 to 3"),
        (["DIR", "-o", "a.jpg"], "expected .gif, .mp4, .pdf, .png or .svg"),
        (["DIR", "-o", "a"], "ends in nothing"),
        (["DIR"], "Name one with -o"),
        (["network", "DIR", "-o", "a.gif"], "Only trials can move"),
        (["lineage", "DIR", "-o", "a.gif"], "Only trials can move"),
        (["lineage", "DIR", "--replicate", "99", "-o", "a.svg"], "its runs are 0 to 2"),
        (["species", "DIR", "--generation", "1", "-o", "a.svg"], "over all generations"),
        (["network", "-o", "a.svg"], "No results folder"),
        (["netwrk", "DIR", "-o", "a.svg"], "lineage, archive, divergence, movie, arena or robot first"),
        (["movie", "-o", "a.gif"], "No results folder. Name one: realitygap show movie results/paper"),
        (["movie", "DIR", "-o", "a.png"], "expected .gif or .mp4"),
        (["movie", "DIR", "--each", "run", "-o", "a.gif"], "Unknown each 'run'"),
        (["movie", "DIR", "DIR", "--each", "condition", "-o", "a.gif"], "2 results with each 'condition'"),
        (
            ["movie", "DIR", "--each", "individual", "--individual", "1", "-o", "a.gif"],
            "Not for each 'individual': individual.",
        ),
        (["movie", "DIR", "--speed", "0", "-o", "a.gif"], "speed is 0, expected a number from 0.01 to 100"),
        (
            ["movie", "DIR", "--condition", "x", "--each", "individual", "-o", "a.gif"],
            "Unknown condition 'x'",
        ),
        (["movie", "nowhere", "-o", "a.gif"], "nowhere does not exist"),
        (["divergence", "DIR", "-o", "a.svg"], "no second condition or platform"),
        (["divergence", "DIR", "--against", "novelty-5O", "-o", "a.svg"], "Did you mean 'novelty-50'?"),
        (
            ["divergence", "DIR", "--against", "jyro", "--repeats", "1", "-o", "a.svg"],
            "repeats is 1, expected",
        ),
        (["divergence", "DIR", "--against", "jyro", "-o", "a.gif"], "expected .pdf, .png or .svg"),
        (["DIR", "--against", "jyro", "-o", "a.svg"], "--against. Leave that out."),
        (["DIR", "--speed", "2", "-o", "a.svg"], "--speed. Leave that out."),
        (["network", "DIR", "DIR", "-o", "a.svg"], "Only a movie shows several"),
        (["arena", "papr", "-o", "a.svg"], "Did you mean 'paper'?"),
        (["robot", "r2d2", "-o", "a.svg"], "Known: create3, e-puck, epuck2, jyro"),
        (["robot", "jyro", "--robot", "khepera", "-o", "a.svg"], "Not for robot: --robot"),
        (["arena", "none.svg", "-o", "a.svg"], "There is no arena file none.svg"),
        (["arena", "--condition", "x", "-o", "a.svg"], "Not for arena: --condition"),
        (["nowhere", "-o", "a.svg"], "nowhere does not exist"),
        (["DIR", "--replicate", "9" * 20, "-o", "a.svg"], f"has no run {'9' * 20} in"),
        (["species", "DIR", "--replicate", "9" * 20, "-o", "a.svg"], "has no run"),
        (["DIR", "--replicate", "-1", "-o", "a.svg"], "has no run -1 in"),
        (["DIR", "-o", "no/where/a.svg"], "Could not write no/where/a.svg"),
    ],
)
def test_mistakes_are_one_message_and_leave_no_file(results, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RealityGapError) as caught:
        show(*(results if word == "DIR" else word for word in words))
    assert message in str(caught.value)
    assert not list(tmp_path.iterdir())
