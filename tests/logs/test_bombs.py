"""Small files that stand for a lot of memory are refused before it is taken."""

from __future__ import annotations

import bz2
import subprocess
import sys
from pathlib import Path

import lz4.frame
import polars as pl
import pytest
import zstandard

from realitygap._limits import LimitError
from realitygap.errors import LogError
from realitygap.logs import _parquet, _unpacking, open_source

LIMIT = 600 << 20
"""Memory that a reader may take, on top of what its process has [bytes]."""

READER = f"""
import resource, sys, warnings
from pathlib import Path
from realitygap.errors import LogError
from realitygap.logs import open_source

def read(path):
    source = open_source(Path(path))
    return [len(batch.columns) for batch in source.batches(source.columns()[-1:])]

for path in sys.argv[1:3]:  # files as they should be, so that libraries are loaded
    read(path)
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + {LIMIT}, resource.RLIM_INFINITY))
for path in sys.argv[3:]:
    try:
        read(path)
    except LogError as error:
        print(error)
"""


def write_mcap(path: Path, n: int, compression: str = "ZSTD") -> Path:
    """Write two JSON messages, the first with n spaces in it."""
    from mcap.writer import CompressionType, Writer

    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType[compression])
        writer.start()
        channel = writer.register_channel(topic="/drive", message_encoding="json", schema_id=0)
        for k, blank in enumerate((n, 1)):
            writer.add_message(channel, k, b'{"left":' + b" " * blank + b"1}", k)
        writer.finish()
    return path


def write_list(path: Path, n: int) -> Path:
    """Write a list of n zeros, and one of two."""
    lists = pl.Series([pl.repeat(0.0, n, eager=True), pl.Series([0.0, 1.0])])
    pl.DataFrame({"t": [0.0, 0.1], "action": lists}).write_parquet(path, compression="zstd")
    return path


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="only Linux states the memory of a process")
def test_bomb_is_refused_in_little_memory(tmp_path):
    whole = [write_mcap(tmp_path / "whole.mcap", 1), write_list(tmp_path / "whole.parquet", 3)]
    bombs = [
        write_list(tmp_path / "list.parquet", 34 << 20),
        write_mcap(tmp_path / "zstd.mcap", 140 << 20),
        write_mcap(tmp_path / "lz4.mcap", 140 << 20, "LZ4"),
    ]
    assert sum(path.stat().st_size for path in bombs) < 2 << 20
    done = subprocess.run(
        [sys.executable, "-c", READER, *map(str, whole + bombs)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()
    assert [
        "expected at most 33,554,432" in said[0],
        *("134,217,728 bytes" in line for line in said[1:]),
    ] == [True] * 3


def test_list_that_is_too_long_is_refused_and_other_columns_are_read(tmp_path, monkeypatch):
    path = write_list(tmp_path / "log.parquet", 500)
    monkeypatch.setattr(_parquet, "MOST_VALUES", 400)
    source = open_source(path)
    (batch,) = source.batches(["t"])
    assert batch.columns["t"].tolist() == [0.0, 0.1]
    with pytest.raises(LogError, match=r"has 511 values of action, t in one part, expected at most 400"):
        list(source.batches(["t", "action[0]"]))


PACKED = {
    "zstd": (zstandard.compress, _unpacking._unpack_zstd),
    "lz4": (lz4.frame.compress, _unpacking._unpack_lz4),
    "bz2": (bz2.compress, _unpacking._unpack_bz2),
}


@pytest.mark.parametrize(("pack", "unpack"), PACKED.values(), ids=PACKED)
def test_part_of_a_bag_is_unpacked_up_to_a_limit(monkeypatch, pack, unpack):
    data = bytes(range(256)) * 9000
    assert unpack(pack(data)) == data
    assert unpack(pack(data) + pack(b"more")) == data + b"more"
    monkeypatch.setattr(_unpacking, "MOST_UNPACKED", len(data))
    assert unpack(pack(data)) == data
    with pytest.raises(LimitError, match="more than 2,304,000 bytes"):
        unpack(pack(data + b"1"))
    for torn in (pack(data)[:-9], b"no such format"):
        with pytest.raises(Exception):  # noqa: B017, PT011  # each library has its own
            unpack(torn)
