"""A mapping guessed from the names of columns, which is shown before it is believed."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from realitygap.errors import LogError

from ._log_map import LogMap
from ._open import open_source
from ._parquet import EPISODE
from ._source import MOST_SHOWN, Source

LEFT = {"left", "l", "vl", "wl", "lw", "lspeed", "leftspeed", "omegal", "vleft", "lmotor"}
RIGHT = {"right", "r", "vr", "wr", "rw", "rspeed", "rightspeed", "omegar", "vright", "rmotor"}
COUNTED = {
    "enc",
    "encoder",
    "encoders",
    "tick",
    "ticks",
    "count",
    "counts",
    "odo",
    "odometer",
    "pos",
    "position",
}
FORWARD = {"forward", "linear", "lin", "v", "vx", "vlin", "translation", "x.vel"}
TURN = {"turn", "angular", "ang", "w", "wz", "omega", "vth", "yawrate", "rotation", "rot", "theta.vel"}
TIME = ("time", "t", "timestamp", "stamp", "sec", "secs", "seconds", "elapsed", "clock", "ts")
HEADING = {"theta", "yaw", "heading", "th", "phi", "psi", "angle", "orientation", "rz", "a"}
TRUTH = {"gt", "true", "truth", "mocap", "vicon", "optitrack", "camera", "cam", "tracker", "ground"}
"""Words in names of columns that distinguish observed poses from those that the robot estimates."""
SENSOR = re.compile(r"^(.*?(?:ir|prox|ps|range|sonar|sensor|ds|us|tof)\D*?)(\d+)\D*$", re.IGNORECASE)
UNITS = {
    "mm": "mm", "millimeters": "mm", "cm": "cm", "centimeters": "cm", "m": "m", "meters": "m", "in": "in",
    "inches": "in", "rpm": "rpm", "deg": "deg", "degrees": "deg", "rad": "rad", "radians": "rad", "ticks": "ticks",
    "percent": "percent", "pct": "percent",
}  # fmt: skip
TIME_UNITS = {"ms": "ms", "msec": "ms", "millis": "ms", "us": "us", "usec": "us", "micros": "us", "ns": "ns",
              "nsec": "ns", "nanos": "ns", "min": "min"}  # fmt: skip


def guess_log_map(path: str | Path) -> LogMap:
    """Return a mapping for a log, by the names of its columns.

    Args:
        path: The log.

    Raises:
        LogError: The names do not say which columns are the wheels; the message lists them, and what a mapping has.
    """
    path = Path(path)
    source = open_source(path)
    names = source.columns()
    parts = {
        "commands": _commands(names),
        "wheels": _wheels(names),
        "poses": _poses(names),
        "readings": _readings(names),
    }
    ranges = _ranges(source, names)
    if ranges is not None:
        parts["readings"] = ranges
    values: dict[str, Any] = {name: part for name, part in parts.items() if part is not None}
    if "commands" not in values and "wheels" not in values:
        shown = ", ".join(names[:MOST_SHOWN])
        raise LogError(
            f"{path}: the names of its columns do not say which are the wheels: {shown}. Write a mapping, and name it "
            "with --map."
        )
    if source.is_table:
        time = _time(names)
        if time is None and not source.rate_hz:
            raise LogError(
                f"{path}: no column looks like the time: {', '.join(names[:MOST_SHOWN])}. Write a mapping with `time`, "
                "or `rate_hz`, and name it with --map."
            )
        for name in parts.keys() & values.keys():
            values[name] |= time or {}
        if EPISODE in names:
            values["trial"] = EPISODE
    else:
        _check_topics(source, values)
    return LogMap(**values)


def tokens_of(name: str) -> list[str]:
    """Return the words of a name, in lower case: leftSpeed_mm_s has left, speed, mm, s."""
    name = re.sub(r"([a-z])([A-Z])", r"\1 \2", name)
    return [part for part in re.split(r"[^a-zA-Z0-9]+", name.lower()) if part]


def _pick(names: Iterable[str], wanted: Callable[[list[str]], bool]) -> str:
    """Return the column that fits, observed poses before the robot's own; empty if no column fits."""
    found = [name for name in names if wanted(tokens_of(name))]
    return min(found, key=lambda name: (not TRUTH & set(tokens_of(name)), len(name)), default="")


def unit_in(name: str, default: str) -> str:
    """Return the unit in a name, without that of the time."""
    return next((UNITS[token] for token in reversed(tokens_of(name)[1:]) if token in UNITS), default)


def _speed_unit(name: str) -> str:
    unit = unit_in(name, "m")
    return unit if unit in ("rpm", "percent") else f"{unit}/s"


def _has(words: set[str], *, without: set[str] = frozenset()) -> Callable[[list[str]], bool]:  # type: ignore[assignment]
    return lambda tokens: bool(words & set(tokens)) and not without & set(tokens)


def _commands(names: Sequence[str]) -> dict[str, Any] | None:
    left = _pick(names, _has(LEFT, without=COUNTED))
    right = _pick(names, _has(RIGHT, without=COUNTED))
    if left and right:
        return {"left": left, "right": right, "unit": _speed_unit(left)}
    for place in ("/linear/x", "/twist/linear/x", "/twist/twist/linear/x"):  # ROS, commands before odometry
        for name in sorted(names, key=lambda name: "cmd" not in name):
            if name.endswith(place) and (turn := name.removesuffix("linear/x") + "angular/z") in names:
                return {"forward": name, "turn": turn}
    if {"/call/drive/move", "/call/drive/turn"} <= set(names):  # our own recordings
        return {
            "forward": "/call/drive/move",
            "turn": "/call/drive/turn",
            "unit": "share",
            "turn_unit": "share",
        }
    flat = [name for name in names if "/" not in name]
    forward, turn = _pick(flat, _has(FORWARD, without=COUNTED)), _pick(flat, _has(TURN, without=COUNTED))
    if forward and turn and forward != turn:
        rate = unit_in(turn, "rad")
        return {
            "forward": forward,
            "turn": turn,
            "unit": _speed_unit(forward),
            "turn_unit": rate if rate == "rpm" else f"{rate}/s",
        }
    return None


def _wheels(names: Sequence[str]) -> dict[str, Any] | None:
    left = _pick(names, lambda tokens: bool(LEFT & set(tokens) and COUNTED & set(tokens)))
    right = _pick(names, lambda tokens: bool(RIGHT & set(tokens) and COUNTED & set(tokens)))
    if not (left and right):
        return None
    is_ticks = bool({"enc", "encoder", "encoders", "tick", "ticks", "count", "counts"} & set(tokens_of(left)))
    return {"left": left, "right": right, "unit": unit_in(left, "ticks" if is_ticks else "m")}


def _poses(names: Sequence[str]) -> dict[str, Any] | None:
    for x in names:  # ROS
        if x.endswith("/position/x") or x.endswith("/translation/x"):
            above = x.rsplit("/", 2)[0]
            around = next(
                (f"{above}/{kind}" for kind in ("orientation", "rotation") if f"{above}/{kind}/w" in names),
                "",
            )
            place = x.removesuffix("/x")
            if around:
                return {"x": x, "y": f"{place}/y", "quaternion": [f"{around}/{axis}" for axis in "xyzw"]}
    flat = [name for name in names if "/" not in name]

    def has_axis(axis: str) -> Callable[[list[str]], bool]:
        def wanted(tokens: list[str]) -> bool:
            others = {
                "vel",
                "speed",
                "v",
                "acc",
                "accel",
                "mag",
                "gyro",
                "cmd",
                "target",
                "goal",
                "std",
                "var",
                "cov",
            }
            return axis in tokens and not others & set(tokens)

        return wanted

    x, y = _pick(flat, has_axis("x")), _pick(flat, has_axis("y"))
    if not (x and y):
        return None
    heading = _pick(flat, _has(HEADING, without={"vel", "speed", "rate", "cmd", "acc", "gyro"}))
    found: dict[str, Any] = {"x": x, "y": y, "unit": unit_in(x, "m")}
    if heading:
        found |= {"heading": heading, "heading_unit": unit_in(heading, "rad")}
    return found


def _readings(names: Sequence[str]) -> dict[str, Any] | None:
    """Return the largest family of columns with a number at the end, such as ir0 to ir7."""
    families: dict[str, list[tuple[int, str]]] = {}
    for name in names:
        match = SENSOR.match(name)
        if match:
            families.setdefault(match[1], []).append((int(match[2]), name))
    family = max(families.values(), key=len, default=[])
    if len(family) < 2:
        return None
    return {"sensors": [name for _, name in sorted(family)]}


def _ranges(source: Source, names: Sequence[str]) -> dict[str, Any] | None:
    """Return the messages of type sensor_msgs/Range, by their fields: lengths, of which 0 is the nearest."""
    sensors = [name for name in names if name.endswith("/range") and f"{name[:-5]}max_range" in names]
    if not sensors:
        return None
    sensors.sort(
        key=lambda name: [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)]
    )
    most = [f"{name[:-5]}max_range" for name in sensors]
    full = max(float(next(iter(source.batches([name]))).columns[name][0]) for name in most)
    return {"sensors": sensors, "full": full, "inverted": True}


def _time(names: Sequence[str]) -> dict[str, str] | None:
    for word in TIME:
        for name in names:
            tokens = tokens_of(name)
            if word in tokens or (len(tokens) == 1 and tokens[0].startswith(word) and len(word) > 2):
                unit = next((TIME_UNITS[token] for token in tokens[1:] if token in TIME_UNITS), "s")
                return {"time": name, "time_unit": unit}
    return None


def _check_topics(source: Source, values: dict[str, Any]) -> None:
    """Leave out times: messages have that of their recording."""
    for name in ("readings", "wheels"):
        part = values.get(name)
        columns = part and (part.get("sensors") or [part.get("left"), part.get("right")])
        if columns and all(str(column).endswith("/range") for column in columns):
            continue
        if columns and len({str(column).rpartition("/")[0] for column in columns}) != 1:
            del values[name]
    if "commands" not in values and "wheels" not in values:
        raise LogError(
            f"{source.path}: its wheels are on several topics. Write a mapping, and name it with --map."
        )
