"""Recordings of `realitygap robot drive --record`, whose calls are topics such as `/call/drive`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from realitygap.errors import LogError
from realitygap.robots import read_recording

from ._source import RECORDED, Batch, check_columns


class RecordingSource:
    """A recording of a session with a robot.

    Raises:
        RecordError: It cannot be read.
    """

    is_table = False
    rate_hz = 0.0

    def __init__(self, path: Path) -> None:
        self.path = path
        self._rows: dict[str, list[dict[str, float]]] = {}
        for line in read_recording(path).lines:
            if line["kind"] == "call":
                topic = f"/call/{line['name']}"
                numbers = {f"{topic}/{RECORDED}": float(line["t"])}
                for name, value in dict(line.get("values") or {}).items():
                    parts = value if isinstance(value, list) else [value]
                    for k, part in enumerate(parts):
                        if isinstance(part, bool | int | float):
                            key = f"{topic}/{name}[{k}]" if isinstance(value, list) else f"{topic}/{name}"
                            numbers[key] = float(part)
                self._rows.setdefault(topic, []).append(numbers)

    def columns(self) -> list[str]:
        """Return the names of all columns with numbers."""
        return list(dict.fromkeys(name for rows in self._rows.values() for row in rows for name in row))

    def time_of(self, names: Sequence[str]) -> str:
        """Return the time of a call."""
        return RECORDED

    def batches(self, names: Sequence[str], rows: str = "") -> Iterator[Batch]:
        """Yield batches like `Source.batches`. All columns must be of one kind of call."""
        topics = {name.rpartition("/")[0] for name in names if name != RECORDED}
        if len(topics) != 1:
            raise LogError(
                f"{self.path}: {', '.join(names)} are of several calls, expected one for each part."
            )
        topic = topics.pop()
        wanted = [name if name != RECORDED else f"{topic}/{RECORDED}" for name in names]
        check_columns(self, wanted)
        table = [[row.get(name, np.nan) for name in wanted] for row in self._rows[topic]]
        values = np.array(table, np.float64)
        yield Batch(1, {name: values[:, k] for k, name in enumerate(names)})
