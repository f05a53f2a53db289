"""Every format that realitygap reads: a valid example, and the function that reads it.

`FORMATS[name]` is `(valid, read)`: the bytes of a small valid file, and a function that takes bytes. It returns what it
read, or raises one of `REFUSALS`. Any other exception, a hang, or a crash is a fault.
"""

from __future__ import annotations

import io
import json
import os
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple
from zlib import adler32, crc32

import numpy as np

from realitygap.errors import RealityGapError

REFUSALS = (RealityGapError,)
"""What a reader may raise. The command line prints each as one message."""


class Format(NamedTuple):
    """A format: the bytes of a small valid file, and what reads such bytes."""

    valid: bytes
    read: Callable[[bytes], Any]


def _reader(name: str, read: Callable[[Path], Any]) -> Callable[[bytes], Any]:
    """Return a function that writes bytes to a file of this name in a new folder and reads it."""

    def from_bytes(data: bytes) -> Any:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            return read(path)

    return from_bytes


def _written(name: str, write: Callable[[Path], Any]) -> bytes:
    """Return the bytes of a file that a function writes at the path that it gets."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()


# TOML and SVG

_STUDY = b"""\
[study]
name = "small"
seed = 7
replicates = 2

[neat]
population = 10
generations = 3

[[condition]]
name = "coverage"
selection = "coverage"

[[condition]]
name = 'novelty'  # "quoted"
selection = "novelty"
"""

_ROBOT = b"""\
base = "scribbler-s2-fluke2"
name = "mine"

[drive]
track = 0.15
"""

_ARENA = b"""\
name = "box"
wall = [[0, 0, 2, 0], [2, 0, 2, 1], [2, 1, 0, 1], [0, 1, 0, 0]]
start = [0.4, 0.5, 0.0]

[grid]
x = 0.0
y = 0.0
cell = 0.25
columns = 8
rows = 4
"""

_SVG = b"""\
<svg xmlns="http://www.w3.org/2000/svg" width="80cm" height="500mm" viewBox="0 0 800 500">
<rect width="800" height="500" fill="none"/><g transform="translate(10 10) rotate(5)">
<path d="M 300 100 L 350 100 V 150 Z"/></g><circle id="goal" cx="600" cy="300" r="40"/>
<line id="start" x1="100" y1="100" x2="150" y2="100"/></svg>
"""

_LENS = b"""\
format = 'realitygap lens 1'
width = 640
height = 480
focal = [600.0, 600.0]
center = [319.5, 239.5]
distortion = [0.0, 0.0, 0.0, 0.0, 0.0]
rms = 0.2
"""


def _study(data: bytes) -> Any:
    from realitygap.study import load_study

    return _reader("study.toml", load_study)(data)


def _robot(path: Path) -> Any:
    from realitygap.world import load_robot

    return load_robot(path)


def _arena(path: Path) -> Any:
    from realitygap.world import load_arena

    return load_arena(path)


def _floor_arena(path: Path) -> Any:
    """Read an arena whose floor has an image; the bytes are those of the image."""
    arena = path.with_name("arena.toml")
    arena.write_bytes(_ARENA + b'\n[floor.image]\nfile = "floor.png"\nwidth = 1.0\n')
    return _arena(arena)


_MAP = b"""\
image: map.png
resolution: 0.05
origin: [-1.0, -1.0, 0.1]
negate: 0
occupied_thresh: 0.98
free_thresh: 0.95
"""


def _map(path: Path) -> Any:
    """Read an arena from a map of ROS; the bytes are those of its YAML file or of its image."""
    from realitygap.vision import arena_of_map

    if path.suffix == ".yaml":
        path.with_name("map.png").write_bytes(_image("PNG", 16))
    else:
        path.with_name("map.yaml").write_bytes(_MAP)
    return arena_of_map(path.with_name("map.yaml"))


def _calibration(path: Path) -> Any:
    from realitygap.world import load_calibration

    return load_calibration(path)


def _valid_calibration() -> bytes:
    from realitygap.world import Calibration, Fitted

    track = Fitted(
        name="drive.track", estimate=0.15, low=0.14, high=0.16, prior_low=0.1, prior_high=0.2, identified=True, unit="m"
    )  # fmt: skip
    made = Calibration(
        kind="motion", robot="scribbler-s2-fluke2", target="twin:worn.toml", label="TWIN", observe="track", trials=3,
        date="2026-11-21T15:00:00+00:00", method="told", fitted=(track,), numbers={"drive.track": 0.15},
        draws={"drive.track": (0.149, 0.151)},
    )  # fmt: skip
    return made.to_toml().encode()


def _twin(path: Path) -> Any:
    from realitygap.robots.twin import load_twin

    return load_twin(path)


def _valid_twin() -> bytes:
    from realitygap.robots.twin import sample_twin

    return sample_twin("close", 1).to_toml().encode()


def _lens(path: Path) -> Any:
    from realitygap.vision import read_lens

    return read_lens(path)


# JSON


def _case(path: Path) -> Any:
    from realitygap.world._case import Case

    return Case.read(path)


def _valid_case() -> bytes:
    from tests.world.test_case import good

    return json.dumps(good()).encode()


_GENOME = {
    "format": "realitygap genome", "version": 1, "activation": "tanh", "activation_slope": 1.0, "recurrent": False,
    "bias_value": 1.0, "node_bias": False,
    "nodes": [
        {"id": 0, "kind": "input", "bias": 0.0}, {"id": 1, "kind": "bias", "bias": 0.0},
        {"id": 2, "kind": "output", "bias": 0.0}, {"id": 3, "kind": "hidden", "bias": 0.0},
    ],
    "connections": [
        {"innovation": 0, "source": 0, "target": 2, "weight": 0.5, "enabled": True},
        {"innovation": 1, "source": 0, "target": 3, "weight": -1.25, "enabled": True},
        {"innovation": 2, "source": 3, "target": 2, "weight": 1e-3, "enabled": False},
    ],
}  # fmt: skip


def _genome(path: Path) -> Any:
    from realitygap.evolution import Genome

    return Genome.load(path)


def _description(path: Path) -> Any:
    from realitygap.records import ResultsFolder

    return ResultsFolder.open(path.parent).conditions


def _valid_description() -> bytes:
    from realitygap.records import ResultsFolder
    from tests.records.rows import DESCRIPTION

    return _written("r/study.json", lambda path: ResultsFolder.create(path.parent, DESCRIPTION))


def _memory(path: Path) -> Any:
    from realitygap.families.scribbler.emulator._memory import Memory

    return Memory("s2", path)


def _valid_memory() -> bytes:
    from realitygap.families.scribbler.emulator._memory import Memory

    return _written("memory.json", lambda path: Memory("s2", path))


def _transfer(path: Path) -> Any:
    from realitygap.study._transfer.strategies import _adopt

    return _adopt(path.parent, transfer_plan())


def transfer_plan() -> Any:
    """Return the plan of `_TRANSFER`."""
    from realitygap.orders import TransferOrder
    from realitygap.study._transfer.strategies import TransferPlan

    order = TransferOrder(study="sim-paper", to="twin:worn.toml")
    return TransferPlan(order, "objective", {"a": 1}, "twin:worn.toml", "abc")


_TRANSFER = json.dumps(
    {
        "study": "sim-paper", "condition": "objective", "settings": {"a": 1}, "target": "twin:worn.toml",
        "identity": "abc", "budgets": [20], "replicates": 1, "fresh_trials": 20, "runs": 100, "repeats": 8,
        "observe": "cells", "calibration": "", "fit": "", "seed": 1,
    }
)  # fmt: skip


def _draft(path: Path) -> Any:
    from realitygap.lab._scoring_files import read_json

    return read_json(path)


def _frame(data: bytes) -> Any:
    from realitygap.lab._connections import is_of_page

    return is_of_page(data.decode("utf-8", "replace"))


# JSON by lines


def _observations(path: Path) -> Any:
    from realitygap.records import read_observations

    return read_observations(path)


def _valid_observations() -> bytes:
    from realitygap.records import ObservationsHead, TrialRecord, write_observations
    from realitygap.world import paper_arena

    head = ObservationsHead("sim", "SIM", "scribbler-s2-fluke2", paper_arena().to_dict(), 0.5, "track")
    trials = [
        TrialRecord(
            start=(0.19, 0.2, 0.4), step_s=0.5, commands=np.full((2, 2), 0.5), readings=np.full((2, 3), 0.25),
            stalled=np.zeros(2, bool), cells=(3, 7), wheels=np.zeros((3, 2)), poses=np.zeros((3, 3)), number=number,
            purpose="motion", battery_v=7.25,
        )
        for number in range(2)
    ]  # fmt: skip
    return _written("trials.jsonl", lambda path: write_observations(path, head, trials))


def _recording(path: Path) -> Any:
    from realitygap.robots import read_recording

    return read_recording(path).table()


_RECORDING = b"""\
{"format":"realitygap robot recording","version":1,"started":"2026-11-21T15:00:00.000+00:00","robot":"Scribbler"}
{"t":0.5,"kind":"call","name":"drive","values":{"move":0.5,"turn":-1.0}}
{"t":0.6,"kind":"wire","name":"get_all","sent":"41","answered":"0041","took_s":0.02,"outcome":"ok"}
{"t":0.7,"kind":"fault","name":"read","outcome":"no answer"}
"""


def _log(path: Path) -> Any:
    import warnings

    from realitygap.records._log import read_lines

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return read_lines(path)


# binary


def _chunk(path: Path) -> Any:
    from realitygap.records._chunk import read_rows

    return read_rows(path)


_CHUNK_NAME = "coverage.000000000-000000001.parquet"


def _valid_chunk() -> bytes:
    from realitygap.records._chunk import encode_chunk
    from tests.records.rows import HASH, make_rows

    return encode_chunk(Path(), "coverage", 0, make_rows(n=2), HASH)[1]


def resealed(data: bytes) -> bytes:
    """Return a chunk with the seal that its bytes should have, as someone who means harm would write it."""
    from realitygap.records._seal import _SEAL_SIZE, _footer_start, seal

    footer = _footer_start(data)
    try:
        return seal(data[: footer - _SEAL_SIZE] + data[footer:])
    except (IndexError, ValueError, OverflowError):
        return data


def _ledger(path: Path) -> Any:
    from realitygap.records import Ledger

    with Ledger.open(path, writable=False) as ledger:
        found: list[Any] = [ledger.conditions(), ledger.sittings(), ledger.robots(), ledger.trials()]
        found += [ledger.notes(), ledger.scores(), ledger.events(), ledger.used_codes(), ledger.last_sheet()]
        for name in ledger.conditions():
            for generation, _ in ledger.generations(name, 0):
                found.append(ledger.individuals(name, 0, generation))
        for trial in ledger.trials():
            found.append(ledger.record(trial.trial))
        return found


def _valid_ledger() -> bytes:
    from tests.records.test_ledger import drive, new_ledger

    def write(path: Path) -> None:
        with new_ledger(path.parent) as ledger:
            drive(ledger, 1)
            ledger.note("a note", "anna", 1)

    return _written("ledger.sqlite", write)


def _checkpoint(path: Path) -> Any:
    from realitygap.evolution import Population

    return Population.load(path)


def _valid_checkpoint() -> bytes:
    from realitygap.evolution import NeatSettings, Population

    return _written("p.npz", lambda path: Population(3, 2, NeatSettings(population=4), seed=1).save(path))


def _photo(data: bytes) -> Any:
    from realitygap.vision import read_photo

    return read_photo(data)


@cache
def _image(kind: str, side: int) -> bytes:
    from PIL import Image

    shade = np.arange(side, dtype=np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(np.stack([np.add.outer(shade, shade)] * 3, axis=-1)).save(buffer, kind)
    return buffer.getvalue()


def _video(path: Path) -> Any:
    from itertools import islice

    from realitygap.vision import open_source

    return [image.shape for _, image in islice(open_source(str(path)), 10)]


def _valid_video() -> bytes:
    import cv2

    def write(path: Path) -> None:
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 10, (64, 48))
        for k in range(3):
            writer.write(np.full((48, 64, 3), 40 * k, np.uint8))
        writer.release()

    return _written("video.avi", write)


# logs of other programs


def _log_rows(path: Path) -> Any:
    """Read a log as a table of three of its columns."""
    from realitygap.logs import open_source

    source = open_source(path)
    return [batch.columns for batch in source.batches(source.columns()[:3])]


_LOG_ROWS = {"t": [0.1 * k for k in range(40)], "left": [0.1] * 40, "right": [0.2] * 40}


@cache
def _valid_log_parquet() -> bytes:
    import polars as pl

    buffer = io.BytesIO()
    pl.DataFrame(_LOG_ROWS | {"action": [[0.1, 0.2]] * 40}).select("action", "t", "left").write_parquet(
        buffer
    )
    return buffer.getvalue()


def _valid_mcap(compression: str) -> bytes:
    from mcap.writer import CompressionType, Writer

    buffer = io.BytesIO()
    writer = Writer(buffer, compression=CompressionType[compression])
    writer.start()
    channel = writer.register_channel(topic="/drive", message_encoding="json", schema_id=0)
    for k in range(40):
        writer.add_message(channel, k, json.dumps({"left": 0.1, "right": [0.2, k]}).encode(), k)
    writer.finish()
    return buffer.getvalue()


@cache
def _valid_bag(name: str) -> bytes:
    """Return the bytes of a bag of ROS 2 that realitygap wrote, or of a file in its folder."""
    from realitygap.logs import write_bag
    from realitygap.records import read_observations

    def write(path: Path) -> None:
        path.with_name("trials.jsonl").write_bytes(_valid_observations())
        read = read_observations(path.with_name("trials.jsonl"))
        write_bag(read.trials[0], read.head, path)

    if name.endswith(".mcap"):
        return _written(name, write)
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / "bag")
        return next(Path(folder, "bag").glob(f"*{name}")).read_bytes()


def _mapped(path: Path) -> Any:
    """Import a log; the bytes are those of its mapping."""
    from realitygap.logs import import_log, load_log_map

    rows = [",".join(_LOG_ROWS), *(",".join(map(str, row)) for row in zip(*_LOG_ROWS.values(), strict=True))]
    path.with_name("log.csv").write_text("\n".join(rows))
    return import_log(path.with_name("log.csv"), path.with_name("trials.jsonl"), load_log_map(path))


_MAPPING = b"""\
robot = "pioneer"

[commands]
file = "log.csv"
time = "t"
left = "left"
right = "right"
"""


# folders in which files name others


def _dataset(folder: Path) -> Any:
    (folder / "meta").mkdir()
    (folder / "data").mkdir()
    (folder / "meta" / "info.json").write_text('{"fps": 10, "features": {}}')
    for k in range(2):
        (folder / "data" / f"{k}.parquet").write_bytes(FORMATS["log.parquet"].valid)
    return lambda: _log_rows(folder)


def _bag_folder(folder: Path) -> Any:
    (folder / "metadata.yaml").write_bytes(_valid_bag("metadata.yaml"))
    (folder / "bag.db3").write_bytes(_valid_bag(".db3"))
    return lambda: _log_rows(folder)


def _map_folder(folder: Path) -> Any:
    from realitygap.vision import arena_of_map

    (folder / "map.yaml").write_bytes(_MAP)
    (folder / "map.png").write_bytes(_image("PNG", 16))
    return lambda: arena_of_map(folder / "map.yaml")


def _floor_folder(folder: Path) -> Any:
    (folder / "arena.toml").write_bytes(_ARENA + b'\n[floor.image]\nfile = "floor.png"\nwidth = 1.0\n')
    (folder / "floor.png").write_bytes(_image("PNG", 16))
    return lambda: _arena(folder / "arena.toml")


def _study_folder(folder: Path) -> Any:
    (folder / "study.toml").write_bytes(
        _STUDY + b'platform = "sim"\narena = { file = "arena.toml" }\n' + _PLATFORM
    )
    (folder / "arena.toml").write_bytes(_ARENA)
    (folder / "robot.toml").write_bytes(_ROBOT)
    from realitygap.study import load_study

    return lambda: load_study(folder / "study.toml")


_PLATFORM = b'[platform.sim]\nrobot = "robot.toml"\n'


def _results_folder(folder: Path) -> Any:
    (folder / "results").mkdir()
    (folder / "results" / "study.json").write_bytes(_valid_description())
    return lambda: _description(folder / "results" / "study.json")


_FOLDERS = (_dataset, _bag_folder, _map_folder, _floor_folder, _study_folder, _results_folder)
_WHOLE_FOLDERS = b"whole"
_NAMED_BY_USERS = ("study.toml", "map.yaml")
"""A user may name a pipe, which is then waited for."""


def _folders(data: bytes) -> Any:
    """Read one of the folders, in which one file is a pipe, a folder, or a link to a device or to itself.

    Its bytes choose it; those of the valid example choose all folders as they should be.
    """
    for number, make in enumerate(_FOLDERS):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            read = make(folder)
            if data != _WHOLE_FOLDERS:
                if crc32(data) % len(_FOLDERS) != number:
                    continue
                files = [
                    path for path in folder.rglob("*") if path.is_file() and path.name not in _NAMED_BY_USERS
                ]
                _spoil(sorted(files), adler32(data))
            read()


def _spoil(files: list[Path], number: int) -> None:
    victim, kind = files[number % len(files)], number // len(files) % 4
    victim.unlink()
    if kind == 0:
        os.mkfifo(victim)
    elif kind == 1:
        victim.mkdir()
    else:
        victim.symlink_to("/dev/zero" if kind == 2 else victim)


# text


def _table(path: Path) -> Any:
    from realitygap.report import audit_results

    return audit_results(path, denominator=72)


_TABLE = b"""\
condition,run,value
objective,1,0.25
objective,2,0.5
novelty,1,0.75
novelty,2,1.0
"""


def _scores(path: Path) -> Any:
    from realitygap.cli._trials import _read_file
    from tests.records.test_ledger import drive, new_ledger

    with new_ledger(path.parent) as ledger:
        drive(ledger, 1)
        return _read_file(ledger, path)


def _formats() -> dict[str, Format]:
    return {
        "study.toml": Format(_STUDY, _study),
        "robot.toml": Format(_ROBOT, _reader("robot.toml", _robot)),
        "arena.toml": Format(_ARENA, _reader("arena.toml", _arena)),
        "arena.svg": Format(_SVG, _reader("arena.svg", _arena)),
        "map.yaml": Format(_MAP, _reader("map.yaml", _map)),
        "map.png": Format(_image("PNG", 16), _reader("map.png", _map)),
        "twin.toml": Format(_valid_twin(), _reader("twin.toml", _twin)),
        "calibration.toml": Format(_valid_calibration(), _reader("fit.toml", _calibration)),
        "lens.toml": Format(_LENS, _reader("lens.toml", _lens)),
        "case.json": Format(_valid_case(), _reader("case.json", _case)),
        "genome.json": Format(json.dumps(_GENOME).encode(), _reader("genome.json", _genome)),
        "study.json": Format(_valid_description(), _reader("results/study.json", _description)),
        "memory.json": Format(_valid_memory(), _reader("memory.json", _memory)),
        "transfer.json": Format(_TRANSFER.encode(), _reader("t/transfer.json", _transfer)),
        "draft.json": Format(b'{"cells":[1,2,3],"proposal":""}', _reader("draft.json", _draft)),
        "lab frame": Format(b'42["log",{"client_id":"a","level":"info","message":"hi"}]', _frame),
        "observations.jsonl": Format(_valid_observations(), _reader("trials.jsonl", _observations)),
        "recording.jsonl": Format(_RECORDING, _reader("recording.jsonl", _recording)),
        "log.jsonl": Format(
            b'{"event":"start","missing_runs":3}\n{"event":"end"}\n', _reader("log.jsonl", _log)
        ),
        "chunk.parquet": Format(_valid_chunk(), _reader(_CHUNK_NAME, _chunk)),
        "resealed chunk.parquet": Format(
            _valid_chunk(), lambda data: _reader(_CHUNK_NAME, _chunk)(resealed(data))
        ),
        "ledger.sqlite": Format(_valid_ledger(), _reader("ledger.sqlite", _ledger)),
        "checkpoint.npz": Format(_valid_checkpoint(), _reader("population.npz", _checkpoint)),
        "photo.jpg": Format(_image("JPEG", 400), _photo),
        "photo.png": Format(_image("PNG", 400), _photo),
        "floor.png": Format(_image("PNG", 16), _reader("floor.png", _floor_arena)),
        "video.avi": Format(_valid_video(), _reader("video.avi", _video)),
        "log.parquet": Format(_valid_log_parquet(), _reader("log.parquet", _log_rows)),
        "log.mcap": Format(_valid_mcap("ZSTD"), _reader("log.mcap", _log_rows)),
        "lz4 log.mcap": Format(_valid_mcap("LZ4"), _reader("log.mcap", _log_rows)),
        "bag.mcap": Format(_valid_bag("bag.mcap"), _reader("bag.mcap", _log_rows)),
        "bag.db3": Format(_valid_bag(".db3"), _reader("bag.db3", _log_rows)),
        "log.map.toml": Format(_MAPPING, _reader("log.map.toml", _mapped)),
        "folders": Format(_WHOLE_FOLDERS, _folders),
        "results.csv": Format(_TABLE, _reader("results.csv", _table)),
        "scores.txt": Format(b"# by anna\n1: 0 1 13\n", _reader("scores.txt", _scores)),
    }


FORMATS: Mapping[str, Format] = MappingProxyType(_formats())
