"""What was said is in the file, whatever happened, and can be shown, exported and done again."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path

import pytest

from realitygap.errors import RecordError, RecordVersionError, RobotError
from realitygap.families.scribbler import Scribbler
from realitygap.robots import Command, RecordedRobot, Robot, export_mcap, read_recording
from realitygap.testing import RobotContractError, check_robot

from ..families.scribbler.peers import FakeScribbler
from .ports import Wire, WiredPort


def record(path: Path, n_steps: int = 3, wire: Wire | None = None) -> WiredPort:
    port = WiredPort(FakeScribbler("s2+fluke1"), wire)
    with Scribbler(port, record=path, reading_max=1600) as robot:
        for _ in range(2):
            robot.reset()
            for step in range(n_steps):
                robot.observe()
                robot.drive(Command(step / 10, -0.25))
            robot.stop()
    return port


def test_a_recording_says_what_was_recorded_and_holds_every_byte(tmp_path):
    port = record(tmp_path / "one.jsonl")
    recording = read_recording(tmp_path / "one.jsonl")
    assert recording.is_whole
    header = recording.header
    assert header["robot"]["fluke_version"] == "2.9.1"
    assert (header["label"], header["step_s"], header["n_sensors"]) == ("EMULATED", 0.5, 3)
    assert header["reading_max"] == 1600
    assert header["units"]["t"].startswith("s since")
    assert datetime.fromisoformat(header["started"]).tzinfo is not None
    table = recording.table()
    sent = table.filter(kind="wire")["sent"].to_list()
    assert [bytes.fromhex(text) for text in sent] == port.writes
    assert table["outcome"].drop_nulls().unique().to_list() == ["ok"]
    assert table["t"].is_sorted()
    calls = table.filter(kind="call")
    assert calls["name"].to_list() == [*["reset", *["observe", "drive"] * 3, "stop"] * 2, "close"]
    assert json.loads(calls.row(2, named=True)["values"]) == {"move": 0.0, "turn": -0.25}
    assert json.loads(calls.row(1, named=True)["values"])["readings"] == [0.5, 0.5, 0.5]
    assert calls.row(-1, named=True)["t"] == pytest.approx(6 * 0.5)


def test_a_recorded_robot_does_again_what_it_did_and_keeps_the_contract(tmp_path):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FakeScribbler, "fluke_command", varied(FakeScribbler.fluke_command))
        robot = Scribbler(WiredPort(FakeScribbler("s2+fluke1")), record=tmp_path / "one.jsonl")
        seen = []
        observe = robot.observe
        robot.observe = lambda: seen.append(observe()) or seen[-1]  # type: ignore[method-assign]
        check_robot(robot)
    again = RecordedRobot(f"recording:{tmp_path / 'one.jsonl'}")
    assert isinstance(again, Robot)
    assert (again.label, again.step_s, again.n_sensors) == ("EMULATED", 0.5, 3)
    repeated = []
    observe_again = again.observe
    again.observe = lambda: repeated.append(observe_again()) or repeated[-1]  # type: ignore[method-assign]
    check_robot(again)
    assert repeated == seen
    assert len({one.raw for one in seen}) > 5


def varied(command):
    n_calls = 0

    def answer(self, data, n_answer):
        nonlocal n_calls
        n_calls += 1
        return (
            bytes((n_calls % 16, n_calls % 256)) if data[0] in (85, 86, 87) else command(self, data, n_answer)
        )

    return answer


def test_a_call_that_deviates_from_a_recording_is_refused_with_its_step(tmp_path):
    record(tmp_path / "one.jsonl")
    robot = RecordedRobot(tmp_path / "one.jsonl")
    robot.reset()
    with pytest.raises(RobotError, match=r"After step 0, .*one.jsonl has 'observe', got 'drive'"):
        robot.drive(Command(0.0, -0.25))
    robot.observe()
    with pytest.raises(
        RobotError, match=r"In step 1, .* has the command 0.0, -0.25, got 0.5, 0.0. A recorded robot can only"
    ):
        robot.drive(Command(0.5, 0.0))
    robot.stop()
    robot.drive(Command(0.0, -0.25))
    robot.reset()  # the next trial, before the end of this one
    for step in range(3):
        robot.observe()
        robot.drive(Command(step / 10, -0.25))
    with pytest.raises(RobotError, match=r"After step 3, .* ends, got 'observe'"):
        robot.observe()
    with pytest.raises(RobotError, match="ends, got 'reset'"):
        robot.reset()


def test_a_fault_is_recorded_and_comes_again(tmp_path):
    port = WiredPort(FakeScribbler("s2+fluke1"))
    robot = Scribbler(port, record=tmp_path / "one.jsonl")
    robot.reset()
    robot.observe()
    port.wire.to_host = lambda number, byte: b""
    with pytest.raises(RobotError) as caught:
        robot.drive(Command(1, 0))
    with pytest.raises(RobotError):
        robot.close()
    recording = read_recording(tmp_path / "one.jsonl")
    outcomes = [line["outcome"] for line in recording.lines if line["kind"] == "wire"]
    assert "No answer within 2.0 s" in outcomes
    again = RecordedRobot(recording)
    again.reset()
    again.observe()
    with pytest.raises(RobotError, match="Recorded error: ") as repeated:
        again.drive(Command(1, 0))
    assert str(caught.value) in str(repeated.value)


def test_a_robot_that_nobody_reached_leaves_a_recording_of_the_attempts(tmp_path):
    port = WiredPort(FakeScribbler("s2"), Wire(to_host=lambda number, byte: b""))
    with pytest.raises(RobotError):
        Scribbler(port, record=tmp_path / "one.jsonl")
    recording = read_recording(tmp_path / "one.jsonl")
    assert "No Scribbler answers" in recording.header["error"]
    assert len([line for line in recording.lines if line["name"] == "info"]) == 3
    with pytest.raises(RecordError, match="has no label, step_s, n_sensors, because no robot answered"):
        RecordedRobot(recording)


def test_a_recording_cut_anywhere_is_read_up_to_its_last_whole_line(tmp_path):
    record(tmp_path / "one.jsonl", n_steps=1)
    data = (tmp_path / "one.jsonl").read_bytes()
    whole = read_recording(tmp_path / "one.jsonl")
    first = data.index(b"\n") + 1
    for n_bytes in [*range(first, len(data), 37), len(data) - 1]:
        (tmp_path / "cut.jsonl").write_bytes(data[:n_bytes])
        cut = read_recording(tmp_path / "cut.jsonl")
        n_lines = data[:n_bytes].count(b"\n") - 1
        assert cut.lines == whole.lines[:n_lines]
        assert cut.is_whole == (data[n_bytes - 1 : n_bytes] == b"\n")


def test_files_that_are_no_recordings_are_said(tmp_path):
    path = tmp_path / "one.jsonl"
    with pytest.raises(RecordError, match=r"Could not read .*No such file"):
        read_recording(path)
    path.write_bytes(b"")
    with pytest.raises(RecordError, match="is not a recording of a robot"):
        read_recording(path)
    path.write_bytes(b"\x00\xff\n")
    with pytest.raises(RecordError, match="line 1 is no JSON"):
        read_recording(path)
    path.unlink()
    record(path)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([lines[0].replace(b'"version":1', b'"version":9'), *lines[1:]]))
    with pytest.raises(RecordVersionError, match="has version 9 of the format, expected 1"):
        read_recording(path)
    path.write_bytes(b"".join([*lines[:3], b'{"t":1}\n', *lines[3:]]))
    with pytest.raises(RecordError, match="line 4 has no time, kind or name"):
        read_recording(path)


def test_a_recording_never_overwrites_one(tmp_path):
    record(tmp_path / "one.jsonl")
    port = WiredPort(FakeScribbler("s2"))
    with pytest.raises(RecordError, match=r"one.jsonl exists already\. .* Name another file"):
        Scribbler(port, record=tmp_path / "one.jsonl")
    assert not port.is_open


def test_a_full_disk_is_one_error_and_the_motors_stop(tmp_path):
    port = WiredPort(FakeScribbler("s2"))

    class FullFile:
        def write(self, data: bytes) -> int:
            raise OSError(28, "No space left on device")

        def close(self) -> None: ...

    def fill_up() -> None:
        with Scribbler(port, record=tmp_path / "one.jsonl") as robot:
            robot.motors(1, 1)
            robot._recorder._file = FullFile()
            robot.motors(0.5, 0.5)

    with pytest.raises(RecordError, match=r"No space left on device\. Earlier records are safe"):
        fill_up()
    assert port.robot.motors == (100, 100)
    assert not port.is_open


class NoRoom:
    """A file on a full disk."""

    def write(self, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    def close(self) -> None: ...


def test_a_full_disk_does_not_keep_stop_from_stopping(tmp_path):
    port = WiredPort(FakeScribbler("s2"))
    robot = Scribbler(port, record=tmp_path / "one.jsonl")
    robot.motors(1, 1)
    robot._recorder._file = NoRoom()
    with pytest.raises(RecordError, match="No space left"):
        robot.stop()
    assert port.robot.motors == (100, 100)
    robot.close()


def test_a_full_disk_under_the_watchdog_is_said_with_the_next_command(tmp_path):
    port = WiredPort(FakeScribbler("s2"))
    with Scribbler(port, record=tmp_path / "one.jsonl", watchdog_s=1.0) as robot:
        robot.motors(1, 1)
        robot._recorder._file = NoRoom()
        robot.clock.sleep(2.0)
        assert port.robot.motors == (100, 100)
        with pytest.raises(RecordError, match="No space left"):
            robot.light()
        assert robot.light()


def test_the_mcap_export_has_every_line_with_its_time(tmp_path):
    from mcap.reader import make_reader

    record(tmp_path / "one.jsonl")
    recording = read_recording(tmp_path / "one.jsonl")
    assert export_mcap(tmp_path / "one.jsonl", tmp_path / "one.mcap") == len(recording.lines)
    with (tmp_path / "one.mcap").open("rb") as file:
        reader = make_reader(file)
        messages = list(reader.iter_messages(log_time_order=False))
        metadata = next(iter(reader.iter_metadata()))
    assert len(messages) == len(recording.lines)
    assert {channel.topic for _, channel, _ in messages} == {
        *("/call/reset", "/call/observe", "/call/drive", "/call/stop", "/call/close", "/wire")
    }
    drives = [json.loads(message.data) for _, channel, message in messages if channel.topic == "/call/drive"]
    assert drives == [line["values"] for line in recording.lines if line["name"] == "drive"]
    began = datetime.fromisoformat(recording.header["started"]).timestamp()
    last = max(message.log_time for _, _, message in messages) / 1e9
    assert last - began == pytest.approx(max(line["t"] for line in recording.lines), abs=2e-3)
    assert json.loads(metadata.metadata["robot"])["model"] == "s2"
    with pytest.raises(RecordError, match="Could not write"):
        export_mcap(tmp_path / "one.jsonl", tmp_path / "nowhere" / "one.mcap")


def test_a_broken_recorded_robot_would_be_noticed(tmp_path):
    """The check of the contract is not passed by replaying just anything."""
    record(tmp_path / "one.jsonl")
    with pytest.raises((RobotError, RobotContractError)):
        check_robot(RecordedRobot(tmp_path / "one.jsonl"))
