"""One chunk of a study: a Parquet file with the rows of one condition's replicates, first to last."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from realitygap._limits import MOST_CHUNK_BYTES, read_file
from realitygap._parquet_size import check_size
from realitygap._process import use_polars
from realitygap.errors import RecordError, RecordVersionError
from realitygap.records._columns import (
    EXTRA_SCHEMA,
    FAR_PARENTS,
    SCHEMA,
    check_part,
    check_rows,
    has_far_parents,
    schema_with,
)
from realitygap.records._digest import RowsDigest, Stream, row_streams, rows_digest
from realitygap.records._files import reading
from realitygap.records._seal import BrokenSeal, check_seal, seal
from realitygap.records._version import RESULTS_VERSION

_FORMAT = "simulated trials 1"
MAX_REPLICATE = 10**9 - 1
_MAX_CONDITION = 150
"""Longest name of a condition; file systems allow 255 bytes, and a chunk's temporary file adds some 50."""

_CONDITION = re.compile(rf"[A-Za-z0-9_-][A-Za-z0-9._-]{{0,{_MAX_CONDITION - 1}}}")
_NAME = re.compile(
    rf"(?P<condition>{_CONDITION.pattern})\.(?P<first>[0-9]{{9}})-(?P<last>[0-9]{{9}})\.parquet"
)

_AGAIN = (
    "Move it elsewhere or delete it, then run the same command again: only its replicates are recomputed."
)


@dataclass(frozen=True)
class ChunkName:
    """The content of a chunk's file name."""

    condition: str
    first: int
    last: int

    @classmethod
    def parse(cls, name: str) -> ChunkName | None:
        """Return the parts of a file name; None when it is not the name of a chunk."""
        match = _NAME.fullmatch(name)
        if match is None or int(match["last"]) < int(match["first"]):
            return None
        return cls(match["condition"], int(match["first"]), int(match["last"]))

    def __str__(self) -> str:
        return f"{self.condition}.{self.first:09d}-{self.last:09d}.parquet"


@dataclass(frozen=True)
class Chunk:
    """A published chunk whose bytes are as they were written.

    Attributes:
        path: File of the chunk.
        condition: Name of the condition.
        first: First replicate.
        last: Last replicate, inclusive.
        condition_hash: Hash of the condition as resolved, as given by the publisher.
        results_version: Results version that computed the numbers.
        n_rows: Number of rows.
        rows_digest: Digest of the rows' values, hexadecimal sha256.
    """

    path: Path
    condition: str
    first: int
    last: int
    condition_hash: str
    results_version: int
    n_rows: int
    rows_digest: str

    @property
    def replicates(self) -> range:
        """The replicates in this chunk."""
        return range(self.first, self.last + 1)


def check_condition(name: str) -> None:
    """Return when `name` can be part of a file name on every system.

    Raises:
        ValueError: it is empty, too long, begins with a dot, or holds other characters.
    """
    if not isinstance(name, str) or not _CONDITION.fullmatch(name):
        raise ValueError(
            f"Condition {name!r} cannot name a file: expected 1 to {_MAX_CONDITION} characters "
            "out of A-Z a-z 0-9 . _ - and no dot at the start."
        )


def encode_chunk(
    folder: Path, condition: str, first: int, frame: pl.DataFrame, condition_hash: str
) -> tuple[Chunk, bytes]:
    """Return a chunk and the bytes of its file.

    Raises:
        TypeError: `frame` is not a polars frame, or the hash is not text.
        ValueError: `condition`, `first` or the rows are not fit to be published.
    """
    use_polars()
    check_condition(condition)
    if not isinstance(condition_hash, str):
        raise TypeError(f"The condition's hash is {condition_hash!r}, expected text.")
    last = check_rows(frame, condition, first)
    if last > MAX_REPLICATE:
        raise ValueError(f"Replicate {last} is too large, expected at most {MAX_REPLICATE}.")
    frame = frame.select(list(schema_with(frame.columns)))
    path = folder / str(ChunkName(condition, first, last))
    chunk = Chunk(
        path, condition, first, last, condition_hash, RESULTS_VERSION, frame.height, rows_digest(frame)
    )
    buffer = io.BytesIO()
    frame.write_parquet(buffer, compression="zstd", compression_level=1, metadata=_to_metadata(chunk))
    return chunk, seal(buffer.getvalue())


def load_chunk(path: Path) -> Chunk:
    """Return the chunk in a file, after a look at all of its bytes.

    Raises:
        RecordError: the file is torn, foreign, or not what its name says.
    """
    return _open(path)[0]


def read_rows(path: Path, columns: Sequence[str] | None = None) -> tuple[Chunk, pl.DataFrame]:
    """Return a chunk and its rows, or some columns of them; only whole rows are checked against the digest in the file.

    Raises:
        RecordError: the file is torn, foreign, or not what its name says.
    """
    chunk, sealed = _open(path)
    if columns is not None:
        also = [FAR_PARENTS] if "parents" in columns and FAR_PARENTS not in columns else []
        frame = _decode(chunk, sealed, [*columns, *also])
        with _checking(path):
            known = {*SCHEMA, FAR_PARENTS} if has_far_parents(frame) else SCHEMA
            check_part(frame.select(name for name in frame.columns if name in known), chunk.first)
        return chunk, frame.drop(also)
    return chunk, _read_checked(chunk, sealed)[0]


def digest_rows(path: Path, digest: RowsDigest) -> tuple[Chunk, pl.DataFrame]:
    """Feed the rows of a chunk to `digest`, after a check against the digest in the file, and return both.

    Raises:
        RecordError: the file is torn, foreign, or not what its name says.
    """
    chunk, sealed = _open(path)
    frame, streams = _read_checked(chunk, sealed)
    digest.update(streams, frame.height)
    return chunk, frame


def _open(path: Path) -> tuple[Chunk, bytes]:
    use_polars()
    with reading(path):
        sealed = read_file(path, MOST_CHUNK_BYTES, plain=True)
    try:
        check_seal(sealed)
    except BrokenSeal as error:
        raise RecordError(f"{path} {error}. {_AGAIN}") from None
    try:
        check_size(sealed)
    except ValueError as error:
        raise RecordError(f"{path} cannot be read: {error}. {_AGAIN}") from None
    with _decoding(path):
        metadata = pl.read_parquet_metadata(io.BytesIO(sealed))
    chunk = _from_metadata(path, metadata)
    name = ChunkName.parse(path.name)
    if name is None or name != ChunkName(chunk.condition, chunk.first, chunk.last):
        raise RecordError(
            f"{path} holds replicates {chunk.first} to {chunk.last} of condition {chunk.condition!r}, but its "
            f"name differs. Was it renamed? {_AGAIN}"
        )
    return chunk, sealed


def _decode(chunk: Chunk, sealed: bytes, columns: Sequence[str] | None) -> pl.DataFrame:
    with _decoding(chunk.path):
        schema = pl.read_parquet_schema(io.BytesIO(sealed))
    expected = schema_with(schema)
    if schema != expected:
        names = [name for name in {**expected, **schema} if expected.get(name) != schema.get(name)]
        problem = f"{chunk.path} differs from this version's columns in {', '.join(names) or 'their order'}."
        if chunk.results_version != RESULTS_VERSION:
            raise RecordVersionError(
                f"{problem} It was written for results version {chunk.results_version}; "
                "read it with the realitygap that wrote it."
            )
        raise RecordError(f"{problem} {_AGAIN}")
    there = None if columns is None else [name for name in columns if name in expected]
    with _decoding(chunk.path):
        frame = pl.read_parquet(io.BytesIO(sealed), columns=there)
    if columns is None:
        return frame
    lacking = {name: pl.lit(None, EXTRA_SCHEMA[name]) for name in columns if name not in expected}
    if not there:
        frame = pl.DataFrame({"row": pl.arange(chunk.n_rows, eager=True)})
    return frame.with_columns(**lacking).select(columns)


@contextlib.contextmanager
def _decoding(path: Path) -> Iterator[None]:
    """Raise the decoder's errors about an intact file as errors about versions."""
    try:
        yield
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
        raise RecordError(
            f"{path} is intact, but polars {pl.__version__} cannot read it ({error}). "
            "Was it written with a newer polars? Install that one."
        ) from error


def _read_checked(chunk: Chunk, sealed: bytes) -> tuple[pl.DataFrame, list[Stream]]:
    frame = _decode(chunk, sealed, None)
    streams = list(row_streams(frame))
    digest = RowsDigest()
    digest.update(streams, frame.height)
    other_rows = frame.height != chunk.n_rows or digest.hexdigest() != chunk.rows_digest
    if other_rows or (frame["condition"] != chunk.condition).any():
        raise RecordError(
            f"{chunk.path} is intact, but polars reads other values than those written. "
            "If the same command gives this error again, report it with the version of polars."
        )
    with _checking(chunk.path):
        check_rows(frame, chunk.condition, chunk.first)
    return frame, streams


@contextlib.contextmanager
def _checking(path: Path) -> Iterator[None]:
    """Refuse rows that realitygap never publishes, even with a valid seal."""
    try:
        yield
    except ValueError as error:
        raise RecordError(f"{path} was not written by realitygap: {error} {_AGAIN}") from error


def _to_metadata(chunk: Chunk) -> dict[str, str]:
    return {
        "realitygap.format": _FORMAT,
        "realitygap.condition": chunk.condition,
        "realitygap.first": str(chunk.first),
        "realitygap.last": str(chunk.last),
        "realitygap.condition_hash": chunk.condition_hash,
        "realitygap.results_version": str(chunk.results_version),
        "realitygap.n_rows": str(chunk.n_rows),
        "realitygap.rows_digest": chunk.rows_digest,
    }


def _from_metadata(path: Path, metadata: Mapping[str, str]) -> Chunk:
    if metadata.get("realitygap.format") != _FORMAT:
        raise RecordError(
            f"{path} is of format {metadata.get('realitygap.format')!r}, expected {_FORMAT!r}. {_AGAIN}"
        )
    try:
        return Chunk(
            path,
            metadata["realitygap.condition"],
            int(metadata["realitygap.first"]),
            int(metadata["realitygap.last"]),
            metadata["realitygap.condition_hash"],
            int(metadata["realitygap.results_version"]),
            int(metadata["realitygap.n_rows"]),
            metadata["realitygap.rows_digest"],
        )
    except (KeyError, ValueError) as error:
        raise RecordError(f"{path} lacks a part of its description ({error}). {_AGAIN}") from error
