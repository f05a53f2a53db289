"""Bags of ROS, and MCAP: messages on topics, whose fields are columns named as `/odom/pose/pose/position/x`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from realitygap._limits import LimitError, open_plain, parse_json
from realitygap.errors import LogError, from_extra

from ._source import MOST_APART_S, RECORDED, Batch, Floats, check_columns
from ._unpacking import limit_unpacking

BATCH_MESSAGES = 20_000
MOST_FIELDS = 400
"""Numbers of a message that are offered as columns: not the pixels of an image."""
MOST_MESSAGE = 16 << 20
"""Maximum size of a JSON message [bytes]."""
MOST_LIST = 64
CHECKED_MESSAGES = 200
"""Messages whose stamps are compared with the times of their recording."""
NS = 1e-9


class BagSource:
    """A bag of ROS 2 (a folder, .db3, .mcap), one of ROS 1 (.bag), or MCAP with JSON messages.

    Raises:
        LogError: The file is damaged or cut off, or has none of these.
        MissingExtraError: The extra `import` is not installed.
    """

    is_table = False
    rate_hz = 0.0

    def __init__(self, path: Path) -> None:
        self.path = path
        limit_unpacking()
        if path.suffix == ".mcap" and _is_json(path):
            self._messages: _JsonMessages | _RosMessages = _JsonMessages(path)
        else:
            self._messages = _RosMessages(path)
        self._columns: list[str] | None = None

    def columns(self) -> list[str]:
        """Return the names of the columns that the first message on each topic has."""
        if self._columns is None:
            names: dict[str, None] = {}
            for topic in self._messages.topics():
                for _, message in self._messages.read(topic):
                    names |= dict.fromkeys(list(_flat(topic, message))[:MOST_FIELDS])
                    names[f"{topic}/{RECORDED}"] = None
                    break
            self._columns = list(names)
        return self._columns

    def time_of(self, names: Sequence[str]) -> str:
        """Return the stamp of the messages' header, unless its clock is not that of the recording, or there is none."""
        topics = self._by_topic(names)
        stamp = f"{next(iter(topics))}/header/stamp"
        if len(topics) > 1 or stamp not in self.columns():
            return RECORDED
        delays = [at - _flat(topic, message).get(stamp, np.nan) for topic in topics
                  for at, message in islice(self._messages.read(topic), CHECKED_MESSAGES)]  # fmt: skip
        return stamp if np.abs(np.median(delays)) < MOST_APART_S else RECORDED

    def batches(self, names: Sequence[str], rows: str = "") -> Iterator[Batch]:
        """Yield batches like `Source.batches`. All columns must be of one topic, or the same field of several.

        Several topics give the rows of the first one, with the last value that each of the others had by then.
        """
        if rows:
            raise LogError(f"{self.path} is a bag: `rows` is for text files. Leave it out of the mapping.")
        by_topic = self._by_topic([name for name in names if name != RECORDED])
        topic = next(iter(by_topic))
        if len(by_topic) > 1:
            yield self._joined(by_topic, names)
            return
        wanted = [name if name != RECORDED else f"{topic}/{RECORDED}" for name in names]
        check_columns(self, wanted)
        first, table = 1, []
        for time_s, message in self._messages.read(topic):
            values = _flat(topic, message)
            values[f"{topic}/{RECORDED}"] = time_s
            table.append([values.get(name, np.nan) for name in wanted])
            if len(table) == BATCH_MESSAGES:
                yield _batch(first, names, table)
                first, table = first + len(table), []
        if table:
            yield _batch(first, names, table)

    def _by_topic(self, names: Sequence[str]) -> dict[str, list[str]]:
        """Return the columns of each topic, in order."""
        topics = sorted(self._messages.topics(), key=len, reverse=True)
        by_topic: dict[str, list[str]] = {}
        for name in names:
            topic = next((topic for topic in topics if name.startswith(f"{topic}/")), "")
            by_topic.setdefault(topic, []).append(name)
        if "" in by_topic:
            check_columns(self, names)
        fields = {name.removeprefix(topic) for topic, own in by_topic.items() for name in own}
        if len(by_topic) != 1 and len(fields) != 1:
            raise LogError(
                f"{self.path}: {', '.join(names)} are of {len(by_topic)} topics, expected one for each part of the "
                "mapping, or the same field of each topic."
            )
        return by_topic

    def _joined(self, by_topic: dict[str, list[str]], names: Sequence[str]) -> Batch:
        """Return all rows of the first topic with the values of the others."""
        columns: dict[str, Floats] = {}
        times: Floats = np.empty(0)
        for own in by_topic.values():
            parts = [part.columns for part in self.batches([RECORDED, *own])]
            table = {name: np.concatenate([part[name] for part in parts]) for name in (RECORDED, *own)}
            if not len(times):
                times = table[RECORDED]
                columns = table
                continue
            last = np.searchsorted(table[RECORDED], times, side="right") - 1
            for name in own:
                columns[name] = np.where(last < 0, np.nan, table[name][np.maximum(last, 0)])
        return Batch(1, {name: columns[name] for name in names})


def _batch(first: int, names: Sequence[str], table: list[list[float]]) -> Batch:
    values = np.array(table, np.float64).reshape(len(table), len(names))
    return Batch(first, {name: values[:, k] for k, name in enumerate(names)})


class _RosMessages:
    """Messages of a bag of ROS 1 or 2, by the library rosbags."""

    def __init__(self, path: Path) -> None:
        highlevel = from_extra("rosbags.highlevel", "import")
        typesys = from_extra("rosbags.typesys", "import")
        self.path = path
        try:
            self._reader = highlevel.AnyReader(
                [path], default_typestore=typesys.get_typestore(typesys.Stores.LATEST)
            )
            self._reader.open()
        except Exception as error:  # rosbags, sqlite, and decompressors raise many kinds
            raise _damaged(path, error) from error

    def topics(self) -> list[str]:
        return list(self._reader.topics)

    def read(self, topic: str) -> Iterator[tuple[float, Any]]:
        connections = [known for known in self._reader.connections if known.topic == topic]
        try:
            for connection, stamp, data in self._reader.messages(connections):
                yield stamp * NS, self._reader.deserialize(data, connection.msgtype)
        except Exception as error:
            raise _damaged(self.path, error) from error


class _JsonMessages:
    """Messages of an MCAP file that are JSON, by the library mcap."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._topics = list(dict.fromkeys(channel.topic for channel in _channels(path)))

    def topics(self) -> list[str]:
        return self._topics

    def read(self, topic: str) -> Iterator[tuple[float, Any]]:
        make_reader = from_extra("mcap.reader", "import").make_reader
        try:
            with open_plain(self.path) as file:
                for _, _, message in make_reader(file).iter_messages(topics=[topic]):
                    yield message.log_time * NS, parse_json(message.data, most=MOST_MESSAGE)
        except Exception as error:
            raise _damaged(self.path, error) from error


def _channels(path: Path) -> list[Any]:
    make_reader = from_extra("mcap.reader", "import").make_reader
    try:
        with open_plain(path) as file:
            summary = make_reader(file).get_summary()
    except Exception as error:
        raise _damaged(path, error) from error
    return list(summary.channels.values()) if summary is not None else []


def _is_json(path: Path) -> bool:
    channels = _channels(path)
    return bool(channels) and all(channel.message_encoding == "json" for channel in channels)


def _damaged(path: Path, error: Exception) -> LogError:
    if isinstance(error, LimitError):
        return LogError(f"{path}: {error}.")
    if path.is_file() and not path.stat().st_size:
        return LogError(f"{path} is empty. Record it again.")
    message = str(error).strip().split("\n")[0].rstrip(".")[:200] or type(error).__name__
    if path.suffix == ".mcap":
        advice = f"If it was cut off, `mcap recover {path.name}` saves the whole messages."
    else:
        advice = "Record it again, or reindex it with `ros2 bag reindex`."
    return LogError(
        f"{path} is damaged, cut off, or no such file ({type(error).__name__}: {message}). {advice}"
    )


def _flat(place: str, value: Any) -> dict[str, float]:
    """Return the numbers of a message by the path of their fields."""
    if isinstance(value, bool | int | float | np.number):
        return {place: float(value)}
    if isinstance(value, dict):
        fields = value
    elif isinstance(value, list | tuple | np.ndarray):
        if len(value) > MOST_LIST:
            return {}
        return {
            key: number
            for k, part in enumerate(value)
            for key, number in _flat(f"{place}[{k}]", part).items()
        }
    elif hasattr(value, "__dataclass_fields__"):
        fields = {name: getattr(value, name) for name in value.__dataclass_fields__ if name != "__msgtype__"}
    else:
        return {}
    numbers: dict[str, float] = {}
    for name, part in fields.items():
        numbers |= _flat(f"{place}/{name}", part)
    for sec, nano in (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs")):  # the time of a header
        if {sec, nano} <= set(fields):
            numbers[place] = float(fields[sec]) + float(fields[nano]) * NS
    names = fields.get("name")
    if isinstance(names, list) and all(isinstance(name, str) for name in names):  # the state of joints
        for kind in ("position", "velocity", "effort"):
            values = fields.get(kind, ())
            if len(values) == len(names):
                numbers |= {
                    f"{place}/{name}/{kind}": float(part) for name, part in zip(names, values, strict=True)
                }
    return numbers
