"""`realitygap arena`: arenas from maps of ROS, and back."""

import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.errors import DescriptionError, StudyError
from realitygap.world import load_arena

RUNNER = CliRunner()


def run(*words):
    return RUNNER.invoke(app, ["arena", *map(str, words)], catch_exceptions=False)


def test_an_arena_becomes_a_map_and_the_map_an_arena(tmp_path):
    map_file, file = tmp_path / "paper.yaml", tmp_path / "again.toml"
    assert run("paper", "-o", map_file).stdout == f"Written: {map_file} and paper.pgm\n"
    done = run(map_file, "--start", "0.19,0.19,90", "-o", file)
    assert "(4 walls, start 0.19, 0.19 m, 90 degrees)" in done.stdout
    again = load_arena(file)
    assert len(again.walls) == 4
    assert again.start.heading == pytest.approx(1.5707963)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["paper"], "Name the file to write with -o"),
        (["paper", "-o", "paper.svg"], "Name the file to write with -o"),
        (["room.yaml", "-o", "room.yaml"], "is the arena itself"),
        (["paper", "--start", "1,1,1", "-o", "a.toml"], "--start is only for a map of ROS"),
        (["paper", "--tolerance", "0.1", "-o", "a.yaml"], "--tolerance is only for a map of ROS"),
        (["paper", "--resolution", "0.1", "-o", "a.toml"], "--resolution is only for a map of ROS"),
        (["room.yaml", "--start", "1,1", "-o", "a.toml"], "--start is '1,1', expected three numbers"),
        (["room.yaml", "--start", "1,1,inf", "-o", "a.toml"], "expected three finite numbers"),
    ],
)
def test_words_that_do_not_go_together_have_one_message(words, message):
    with pytest.raises(StudyError, match=message):
        run(*words)


def test_usage_errors_state_the_given_value():
    done = run("paper", "--resolution", "0", "-o", "a.yaml")
    assert done.exit_code == 2
    assert "Invalid value for '--resolution'" in done.stderr
    assert done.stderr.endswith(": expected at least 0.0001, got '0'.\n")


def test_an_arena_by_the_name_of_a_map_says_how_to_convert_it():
    with pytest.raises(DescriptionError, match=r"Convert it: realitygap arena room\.yaml -o arena\.toml"):
        load_arena("room.yaml")
