"""Files that other files name are plain, and in the same folder; nothing waits for a pipe."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from realitygap._named_file import NamedFileError, named_file, open_named
from realitygap.errors import RealityGapError
from tests.formats import FORMATS

ARENA = FORMATS["arena.toml"].valid.decode()
STUDY = FORMATS["study.toml"].valid.decode()
LOG = "t,left,right,x,y\n" + "".join(f"{k / 10},0.1,0.1,{k / 100},0\n" for k in range(30))
HEAD = 'robot = "pioneer"\n'
COMMANDS = '[commands]\ntime = "t"\nleft = "left"\nright = "right"\n'


@contextmanager
def deadline(seconds: int) -> Iterator[None]:
    """End a reader that waits for a pipe."""

    def end(*_: object) -> None:
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def floor(folder: Path, name: str) -> Any:
    from realitygap.world import load_arena

    (folder / "arena.toml").write_text(f"{ARENA}\n[floor.image]\nfile = {name!r}\nwidth = 1.0\n")
    return load_arena(folder / "arena.toml")


def ros_map(folder: Path, name: str) -> Any:
    from realitygap.vision import read_map

    (folder / "map.yaml").write_text(f"image: {name}\nresolution: 0.1\norigin: [0, 0, 0]\n")
    return read_map(folder / "map.yaml")


def read_log(folder: Path, mapping: str) -> Any:
    from realitygap.logs import import_log, mapping_of

    (folder / "log.csv").write_text(LOG)
    (folder / "log.map.toml").write_text(mapping)
    log_map, _ = mapping_of(folder / "log.csv")
    return import_log(folder / "log.csv", folder / "trials.jsonl", log_map)


def part(folder: Path, name: str) -> Any:
    return read_log(folder, f"{HEAD}{COMMANDS}file = {name!r}\n")


def poses(folder: Path, name: str) -> Any:
    return read_log(folder, f'{HEAD}{COMMANDS}[poses]\ntime = "t"\nx = "x"\ny = "y"\nfile = {name!r}\n')


def log_robot(folder: Path, name: str) -> Any:
    return read_log(folder, f"robot = {name!r}\n{COMMANDS}")


def log_arena(folder: Path, name: str) -> Any:
    return read_log(folder, f"{HEAD}arena = {name!r}\n{COMMANDS}")


def log_controller(folder: Path, name: str) -> Any:
    return read_log(folder, f"{HEAD}controller = {name!r}\n{COMMANDS}")


INSIDE: dict[str, Callable[[Path, str], Any]] = {
    "image of a floor": floor,
    "image of a map": ros_map,
    "file of a part of a log": part,
    "file of the poses of a log": poses,
    "robot of a log": log_robot,
    "arena of a log": log_arena,
    "controller of a log": log_controller,
}
"""Places in files whose names must be inside the folder."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a pipe, a folder, and a link to a file elsewhere; and a file next to that folder."""
    inner = tmp_path / "a" / "b"
    inner.mkdir(parents=True)
    os.mkfifo(inner / "pipe.png")
    (inner / "folder.png").mkdir()
    (tmp_path / "x.png").write_bytes(b"secret")
    (inner / "link.png").symlink_to(tmp_path / "x.png")
    (inner / "loop.png").symlink_to(inner / "loop.png")
    return inner


@pytest.mark.parametrize("read", INSIDE.values(), ids=INSIDE)
@pytest.mark.parametrize(
    "name", ["pipe.png", "folder.png", "link.png", "../../x.png", "/etc/passwd", "/dev/zero"]
)
def test_name_of_what_is_no_plain_file_in_the_folder_is_refused(folder: Path, read: Any, name: str) -> None:
    if name == "folder.png" and read in (part, poses):
        return  # a bag is a folder
    with (
        deadline(20),
        pytest.raises(RealityGapError, match="expected a plain file in the same folder or below") as error,
    ):
        read(folder, name)
    assert name in str(error.value)
    assert "\n" not in str(error.value)


def study_with(key: str) -> Callable[[Path, str], Any]:
    def read(folder: Path, name: str) -> Any:
        from realitygap.study import load_study

        (folder / "study.toml").write_text(STUDY + key.format(name))
        return load_study(folder / "study.toml")

    return read


def base(folder: Path, name: str) -> Any:
    from realitygap.world import load_robot

    (folder / "robot.toml").write_text(f"base = {name!r}\n")
    return load_robot(folder / "robot.toml")


def calibrated(folder: Path, name: str) -> Any:
    from realitygap.world import load_robot

    text = FORMATS["calibration.toml"].valid.decode().replace("scribbler-s2-fluke2", name)
    (folder / "fit.toml").write_text(text)
    return load_robot(folder / "fit.toml")


PARSED = {
    "robot of a study": study_with('platform = "sim"\n[platform.sim]\nrobot = "{}"\n'),
    "arena of a study": study_with('[arena]\nfile = "{}"\n'),
    "twin of a study": study_with('platform = "twin:{}"\n'),
    "code of a study": study_with('task = {{ kind = "python:{}:score" }}\n'),
    "base of a robot": base,
    "robot of a calibration": calibrated,
}
"""Places whose files are named as a user names them, and are parsed as descriptions only."""


@pytest.mark.parametrize("read", PARSED.values(), ids=PARSED)
@pytest.mark.parametrize("name", ["pipe.toml", "folder.toml", "/etc/passwd", "/dev/zero"])
def test_description_that_is_no_plain_file_is_refused_without_its_content(
    folder: Path, read: Any, name: str
) -> None:
    if (read, name) == (PARSED["twin of a study"], "/etc/passwd"):
        return  # only the process of the twin reads its file; a study has its hash
    os.mkfifo(folder / "pipe.toml")
    (folder / "folder.toml").mkdir()
    with deadline(20), pytest.raises(RealityGapError) as error:
        read(folder, name)
    assert "root:" not in str(error.value)


def bag(folder: Path, victim: str) -> Path:
    """A folder with the names of a bag and of a dataset, one of them a pipe."""
    (folder / "meta").mkdir()
    (folder / "data").mkdir()
    for name in ("metadata.yaml", "bag_0.db3", "meta/info.json", "data/a.parquet"):
        if name == victim:
            os.mkfifo(folder / name)
        elif (name != "meta/info.json") or victim.startswith(("meta/", "data/")):
            (folder / name).write_text('{"fps": 10}' if name.endswith("json") else "")
    return folder


@pytest.mark.parametrize("victim", ["metadata.yaml", "bag_0.db3", "meta/info.json", "data/a.parquet"])
def test_folder_of_a_log_with_a_pipe_in_it_is_refused(tmp_path: Path, victim: str) -> None:
    from realitygap.logs import open_source

    with deadline(20), pytest.raises(RealityGapError):
        open_source(bag(tmp_path, victim))


@pytest.mark.parametrize("end", [".csv", ".csv.gz", ".parquet", ".mcap", ".db3", ".bag", ".jsonl"])
def test_log_that_is_a_pipe_is_refused(tmp_path: Path, end: str) -> None:
    from realitygap.logs import open_source

    os.mkfifo(tmp_path / f"log{end}")
    with deadline(20), pytest.raises(RealityGapError, match="pipe"):
        open_source(tmp_path / f"log{end}")


def test_named_file_is_opened_up_to_its_limit(folder: Path) -> None:
    (folder / "c").mkdir()
    (folder / "c" / "file.txt").write_bytes(b"12345")
    (folder / "near.txt").symlink_to(folder / "c" / "file.txt")
    for name in ("c/file.txt", "near.txt", "./c/../c/file.txt"):
        with open_named(folder, name, 5) as file:
            assert file.read() == b"12345"
    with pytest.raises(NamedFileError, match="has more than 4 bytes"):
        open_named(folder, "c/file.txt", 4)
    for name in ("", None, 7, "a\0b", "none.txt", "a" * 5000, "loop.png", "folder.png"):
        with pytest.raises(NamedFileError):
            named_file(folder, name)
    assert named_file(folder, "folder.png", or_folder=True) == folder / "folder.png"
