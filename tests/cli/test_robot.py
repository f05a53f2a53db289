"""`realitygap robot` on an emulated robot: what it prints, and its mistakes as one message."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest
from PIL import Image

from realitygap.cli._robot import robot
from tests.commands import run_command

from .invoked import printed

PORT = "emulator://s2?fluke=2&arena=paper&seed=1&speed=off"
S1 = "emulator://s1?fluke=none&arena=paper&seed=1&speed=off"


run = partial(printed, "robot")


def failed(*arguments: object) -> str:
    done = run_command("robot", *map(str, arguments))
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("realitygap: ")
    return done.stderr


def test_every_command_has_an_example_that_begins_with_it():
    for command in robot.registered_commands:
        said = command.callback.__doc__
        assert f"Example: realitygap robot {command.name}" in said
        assert "In Python: realitygap.robots." in said


def test_info_tells_the_set_up_as_a_table_and_as_data():
    assert json.loads(run("info", PORT, "--json"))["fluke"] == "2"
    table = run("info", f"scribbler:{PORT}")
    assert "EMULATED" in table
    found = json.loads(run("info", S1, "--json"))
    assert (found["model"], found["fluke"], found["fluke_version"]) == ("s1", "none", "")
    assert "ahead" not in found


def test_sense_prints_what_the_set_up_has():
    seen = json.loads(run("sense", PORT, "--json"))
    assert set(seen) == {
        *("ir", "light", "line", "stall", "distance", "encoders", "obstacle", "bright", "battery_v")
    }
    assert set(json.loads(run("sense", S1, "--json"))) == {"ir", "light", "line", "stall"}
    assert "battery v" in run("sense", PORT)


def test_drive_drives_for_so_long_and_stops(tmp_path):
    run("drive", PORT, "0.5", "0.25", "--seconds", "2", "--record", tmp_path / "one.jsonl")
    shown = json.loads(run("show-recording", tmp_path / "one.jsonl", "--wire", "--json"))
    assert shown["header"]["robot"]["model"] == "s2"
    wire = [line for line in shown["lines"] if line["kind"] == "wire"]
    drove = next(line for line in wire if line["name"] == "motors")
    assert drove["sent"] == bytes([109, 175, 125, 0, 0, 0, 0, 0, 0]).hex()
    stopped = next(line for line in wire if line["name"] == "stop" and line["t"] > drove["t"])
    assert stopped["t"] - drove["t"] == pytest.approx(2.0, abs=0.1)
    table = run("show-recording", tmp_path / "one.jsonl")
    assert "move 0.500, turn 0.250" in table
    assert "6d" not in table
    assert "Written" in run("export-recording", tmp_path / "one.jsonl", "-o", tmp_path / "one.mcap")
    assert (tmp_path / "one.mcap").read_bytes()[1:5] == b"MCAP"


def test_a_recording_that_a_crash_cut_off_is_shown_with_a_word_about_it(tmp_path):
    run("drive", PORT, "0.5", "--record", tmp_path / "one.jsonl")
    data = (tmp_path / "one.jsonl").read_bytes()
    (tmp_path / "one.jsonl").write_bytes(data[:-9])
    assert "The last line is cut off" in run("show-recording", tmp_path / "one.jsonl")


def test_a_picture_is_a_png_of_the_camera_s_size(tmp_path):
    said = run("picture", PORT, "-o", tmp_path / "one.png", "--kind", "gray")
    assert "(1280 x 800)" in said
    with Image.open(tmp_path / "one.png") as picture:
        assert picture.format == "PNG"
        assert np.asarray(picture).std() > 1


def test_battery_stop_beep_and_list():
    assert run("battery", PORT).endswith(" V\n")
    assert 4 < json.loads(run("battery", PORT, "--json"))["battery_v"] < 12
    assert run("stop", PORT) == "The motors are off.\n"
    assert run("beep", PORT, "--seconds", "0.1") == ""
    for guess in json.loads(run("list", "--json")):
        assert set(guess) == {"port", "seems", "description"}
    assert run("list")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("drive", PORT, "2"), "move is 2.0, expected a number from -1 to 1"),
        (("drive", PORT, "1", "--seconds", "3601"), "--seconds is 3601, expected 0 to 3600"),
        (("beep", PORT, "--seconds", "9"), "seconds is 9.0, expected 0 to 8.191"),
        (("picture", PORT, "-o", "x.jpg"), "does not end in .png"),
        (("picture", PORT, "--kind", "jpg"), "Unknown kind of picture 'jpg'. Did you mean 'jpeg'?"),
        (("battery", S1), "'battery' needs a Fluke; here is S1"),
        (("info", "/dev/no-such-port"), "cannot be opened"),
        (("info", "emulator://s9"), "s9"),
        (("sense", "recording:one.jsonl"), "`realitygap robot show-recording` shows it"),
        (("show-recording", "nothing.jsonl"), "Could not read nothing.jsonl"),
    ],
)
def test_a_mistake_is_one_message(arguments, message):
    assert message in failed(*arguments)
