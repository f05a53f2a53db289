"""Parquet files, and datasets of LeRobot, which are folders of them."""

from __future__ import annotations

import mmap
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import polars as pl

from realitygap._limits import MOST_JSON_BYTES, open_plain, parse_json, read_file
from realitygap._named_file import NamedFileError, named_file
from realitygap._parquet_size import group_sizes
from realitygap.errors import LogError

from ._source import Batch, check_columns

BATCH_ROWS = 200_000
MOST_VALUES = 32 << 20
"""Values of columns that are read together, in what polars unpacks as a whole: a page, or for lists a group of rows."""
MOST_PARTS = 256
"""Numbers in one cell, such as a vector of joint angles."""
EPISODE = "episode_index"
TIME = "timestamp"


class ParquetSource:
    """A Parquet file, or several with the same columns, one after another.

    A column of lists has a column for each entry: `action[0]`, or `action.left` if the entries have names.

    Args:
        path: The file, or the folder that the files belong to.
        files: The files.
        names: Names of the entries of columns of lists.
        rate_hz: Rows each second; 0 if unknown.

    Raises:
        LogError: A file cannot be read.
    """

    is_table = True

    def __init__(
        self,
        path: Path,
        files: Sequence[Path],
        names: dict[str, list[str]] | None = None,
        rate_hz: float = 0.0,
    ) -> None:
        self.path, self.rate_hz = path, rate_hz
        self._files = list(files)
        self._sizes: dict[Path, Counter[str]] = {}
        self._columns = _expressions(self._files[0], names or {})

    def columns(self) -> list[str]:
        """Return the names of all columns with numbers."""
        return list(self._columns)

    def time_of(self, names: Sequence[str]) -> str:
        """Return no column: a table names it in its mapping."""
        return ""

    def batches(self, names: Sequence[str], rows: str = "") -> Iterator[Batch]:
        """Yield batches like `Source.batches`."""
        if rows:
            raise LogError(f"{self.path} is Parquet: `rows` is for text files. Leave it out of the mapping.")
        check_columns(self, names)
        chosen = [self._columns[name].cast(pl.Float64).alias(name) for name in dict.fromkeys(names)]
        roots = {root for expression in chosen for root in expression.meta.root_names()}
        first = 1
        for file in self._files:
            self._check_size(file, roots)
            scan, start = _scan(file), 0
            while True:
                try:
                    frame = scan.slice(start, BATCH_ROWS).select(chosen).collect()
                except (pl.exceptions.PolarsError, OSError) as error:
                    raise LogError(f"{file} cannot be read: {_first_line(error)}.") from None
                if not len(frame):
                    break
                columns = {name: frame[name].fill_null(float("nan")).to_numpy() for name in frame.columns}
                yield Batch(first, columns)
                start, first = start + len(frame), first + len(frame)

    def _check_size(self, file: Path, columns: set[str]) -> None:
        if file not in self._sizes:
            self._sizes[file] = _unpacked_values(file)
        n_values = sum(self._sizes[file][column] for column in columns)
        if n_values > MOST_VALUES:
            raise LogError(
                f"{file} has {n_values:,} values of {', '.join(sorted(columns))} in one part, expected at most "
                f"{MOST_VALUES:,}. Write it again with smaller groups of rows (row_group_size)."
            )


def _scan(file: Path) -> pl.LazyFrame:
    return pl.scan_parquet(file, glob=False, hive_partitioning=False)


def _schema(file: Path) -> pl.Schema:
    try:
        return _scan(file).collect_schema()
    except (pl.exceptions.PolarsError, OSError) as error:
        raise LogError(f"{file} cannot be read as Parquet: {_first_line(error)}.") from None


def _unpacked_values(file: Path) -> Counter[str]:
    """Return the number of values of each column that polars unpacks as a whole; 8 bytes are a value, too."""
    try:
        with open_plain(file) as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as data:
            groups = group_sizes(data)
    except OSError as error:
        raise LogError(f"Cannot read {file}: {error.strerror or error}.") from None
    except ValueError as error:  # mmap raises it for an empty file
        raise LogError(f"{file} cannot be read as Parquet: {error}.") from None
    schema = _schema(file)
    largest: Counter[str] = Counter()
    for group in groups:
        sizes: Counter[str] = Counter()
        for part in group:
            is_nested = part.column in schema and schema[part.column].is_nested()
            sizes[part.column] += max(part.n_values, part.n_bytes // 8) if is_nested else part.page
        largest |= sizes
    return largest


def lerobot_source(folder: Path) -> ParquetSource:
    """Return a dataset of LeRobot, of version 2 or 3, as a source.

    Raises:
        LogError: It is not one, or is not whole.
    """
    info = folder / "meta" / "info.json"
    try:
        values = parse_json(read_file(info, MOST_JSON_BYTES, plain=True))
        rate_hz = float(values["fps"])
        features = dict(values.get("features", {}))
    except OSError as error:
        raise LogError(f"Cannot read {info}: {error.strerror or error}.") from None
    except (ValueError, KeyError, TypeError) as error:
        raise LogError(f"{info} is not as LeRobot writes it: {error}.") from None
    try:
        files = [
            named_file(folder, str(file.relative_to(folder)))
            for file in sorted(folder.glob("data/**/*.parquet"))
        ]
    except NamedFileError as error:
        raise LogError(f"{folder}: {error}") from None
    if not files:
        raise LogError(f"{folder} has no Parquet file in data/. Expected a whole dataset of LeRobot.")
    names = {name: _entry_names(feature) for name, feature in features.items() if isinstance(feature, dict)}
    return ParquetSource(folder, files, names, rate_hz)


def _entry_names(feature: dict[str, Any]) -> list[str]:
    """Return the names of the entries of a feature, which may be listed in a table of groups."""
    names = feature.get("names")
    if isinstance(names, dict):
        names = [name for group in names.values() if isinstance(group, list) for name in group]
    return [str(name) for name in names] if isinstance(names, list) else []


def _expressions(file: Path, names: dict[str, list[str]]) -> dict[str, pl.Expr]:
    """Return the expression of each column with numbers."""
    sizes, schema = _unpacked_values(file), _schema(file)
    lists = [
        name
        for name, kind in schema.items()
        if isinstance(kind, pl.List | pl.Array) and kind.inner is not None and kind.inner.is_numeric()
    ]
    fit = [name for name in lists if sizes[name] <= MOST_VALUES]
    try:
        row = _scan(file).select(fit).head(1).collect()
    except (pl.exceptions.PolarsError, OSError) as error:
        raise LogError(f"{file} cannot be read as Parquet: {_first_line(error)}.") from None
    columns: dict[str, pl.Expr] = {}
    for name, kind in schema.items():
        column = pl.col(name)
        if kind.is_numeric() or kind == pl.Boolean:
            columns[name] = column
        elif isinstance(kind, pl.Datetime):
            columns[name] = column.dt.epoch("ns") / 1e9
        elif isinstance(kind, pl.Duration):
            columns[name] = column.dt.total_nanoseconds() / 1e9
        elif name in lists:
            entries = row[name][0] if name in fit and len(row) else None
            size = int(name not in fit) if entries is None else min(len(entries), MOST_PARTS)
            given = names.get(name, [])
            for k in range(size):
                part = (
                    column.arr.get(k) if isinstance(kind, pl.Array) else column.list.get(k, null_on_oob=True)
                )
                columns[f"{name}[{k}]"] = part
                if len(given) == size:
                    columns[f"{name}.{given[k]}"] = part
        elif isinstance(kind, pl.Struct):
            for field in kind.fields:
                if field.dtype.is_numeric():
                    columns[f"{name}.{field.name}"] = column.struct.field(field.name)
    return columns


def _first_line(error: Exception) -> str:
    return str(error).strip().split("\n")[0].rstrip(".")[:200]
