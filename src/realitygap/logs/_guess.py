"""A mapping guessed from the names of columns and their first values. An uncertain guess is refused."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from realitygap.errors import LogError

from ._guess_time import add_times
from ._guess_values import checked
from ._log_map import LogMap
from ._open import map_name, open_source
from ._parquet import EPISODE
from ._source import MOST_SHOWN, Source
from ._units import UNITS, tokens_of, unit_in

T = TypeVar("T")

LEFT = {"left", "l", "vl", "wl", "lw", "lspeed", "leftspeed", "omegal", "vleft", "lmotor", "dl", "dleft"}
RIGHT = {"right", "r", "vr", "wr", "rw", "rspeed", "rightspeed", "omegar", "vright", "rmotor", "dr", "dright"}
TICKS = {"enc", "encoder", "encoders", "tick", "ticks", "count", "counts"}
COUNTED = TICKS | {"odo", "odometer", "pos", "position", "dl", "dr", "dleft", "dright"}
INCREMENTS = {"delta", "inc", "incr", "increment", "increments", "diff", "dl", "dr", "dleft", "dright"}
FORWARD = {"forward", "linear", "lin", "v", "vx", "vlin", "translation"}
TURN = {"turn", "angular", "ang", "w", "wz", "omega", "vth", "yawrate", "rotation", "rot"}
SPEED = {"vel", "velocity", "speed", "rate", "twist"}
COMMANDED = {"cmd", "command", "commands", "commanded", "target", "targets", "setpoint", "desired", "ref", "action",
             "ctrl", "control", "teleop"}  # fmt: skip
"""Words for commands."""
MEASURED = {"odom", "odometry", "actual", "measured", "meas", "feedback", "estimate", "estimated", "est", "amcl", "ekf",
            "slam", "filtered", "wheel", "wheels", "joint", "states"}  # fmt: skip
"""Words for what the robot measures or estimates of itself."""
HEADING = {"theta", "yaw", "heading", "th", "phi", "psi", "angle", "orientation", "rz", "a"}
ORIENTATION = {"orientation", "rotation", "quaternion", "quat", "q"}
TRUTH = {"gt", "true", "truth", "mocap", "vicon", "optitrack", "camera", "cam", "tracker", "ground"}
"""Words in names of columns that distinguish observed poses from those that the robot estimates."""
NEUTRAL = {
    "pos",
    "position",
    "pose",
    "point",
    "transform",
    "translation",
    "field",
    "data",
    "value",
    "robot",
    "coord",
}
"""Words that say nothing about whose a value is."""
OTHER = {"acc", "accel", "acceleration", "mag", "gyro", "imu", "goal", "std", "var", "cov", "covariance",
         "error", "err", "current", "amp", "amps", "voltage", "volt", "temp", "temperature", "torque",
         "effort", "force", "joy", "axes", "button", "buttons", "pitch", "roll", "bump", "bumper", "cliff",
         "light", "led", "path", "plan", "waypoint", "waypoints", "pixel", "pixels", "px", "arm", "gripper",
         "servo", "tilt", "pan", "tf", "tfs", "transforms", "initialpose", "costmap", "origin", "scan",
         "intensity"}  # fmt: skip
"""Words for quantities that are neither commands nor poses."""
AXES = ("x", "y", "z", "w")
SENSOR = re.compile(r"^(.*?(?:ir|prox|ps|range|sonar|sensor|ds|us|tof)\D*?)(\d+)\D*$", re.IGNORECASE)
SENSORS = {"ir", "prox", "proximity", "ps", "sensor", "sensors", "infrared", "reading", "readings"}
"""Words for range sensors whose readings grow as a wall comes nearer."""


def guess_log_map(path: str | Path) -> LogMap:
    """Return a mapping for a log, by the names of its columns and their first values.

    Args:
        path: The log.

    Raises:
        LogError: The names do not say which columns are the wheels, several could be, or a unit is unknown; the message
            lists them.
    """
    return checked_guess(path)[0]


def checked_guess(path: str | Path) -> tuple[LogMap, list[str]]:
    """Return the guess of `guess_log_map`, and what the values of the columns showed."""
    log_map = draft_log_map(path)
    return checked(open_source(Path(path), log_map.text), log_map)


def draft_log_map(path: str | Path) -> LogMap:
    """Return a guess by the names of the columns alone, the units of which may be wrong.

    Raises:
        LogError: As for `guess_log_map`.
    """
    path = Path(path)
    source = open_source(path)
    names = source.columns()
    commands, commanding = _commands(path, names)
    parts = {
        "commands": commands,
        "wheels": _wheels(path, names, commanding),
        "poses": _poses(path, names),
        "readings": _ranges(source, names) or _readings(names),
    }
    values: dict[str, Any] = {name: part for name, part in parts.items() if part is not None}
    if "commands" not in values and "wheels" not in values:
        measured = _measured(names)
        why = (
            f"{' and '.join(measured)} are speeds that the robot measured, and no column looks like commands"
            if measured
            else f"the names of its columns do not say which are the wheels: {', '.join(names[:MOST_SHOWN])}"
        )
        raise LogError(f"{path}: {why}. Write a mapping next to it, {map_name(path)}.")
    if source.is_table:
        add_times(source, names, values)
        if EPISODE in names:
            values["trial"] = EPISODE
    else:
        _check_topics(source, values)
    return LogMap(**values)


def _words_of(name: str) -> set[str]:
    return set(tokens_of(name))


def _speed_unit(name: str) -> str:
    unit = unit_in(name, "m")
    return unit if unit in ("rpm", "percent") else f"{unit}/s"


def _owner(words: Iterable[str], *roles: set[str]) -> frozenset[str]:
    """Return the words that say whose value it is: without its role, its unit, and neutral ones."""
    rest = set(words) - NEUTRAL - UNITS.keys() - {"s"}
    return frozenset(rest.difference(*roles))


def _only(path: Path, what: str, candidates: Sequence[tuple[int, T]], shown: Callable[[T], str]) -> T | None:
    """Return the candidate of the lowest rank; None if there is none.

    Raises:
        LogError: There are several of that rank.
    """
    best = [value for rank, value in candidates if rank == min(rank for rank, _ in candidates)]
    if len(best) > 1:
        raise LogError(
            f"{path}: several columns could be the {what}: {'; '.join(shown(value) for value in best[:6])}. Write a "
            f"mapping next to it, {map_name(path)}."
        )
    return best[0] if best else None


def _pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return the columns of a left and a right wheel whose names differ by these words alone."""
    sides: list[dict[tuple[str, ...], list[str]]] = [{}, {}]
    for name in names:
        tokens = tokens_of(name)
        for side, words in zip(sides, (LEFT, RIGHT), strict=True):
            if len(words & set(tokens)) == 1 and not (OTHER | SENSORS) & set(tokens):
                key = tuple("*" if token in words else token for token in tokens)
                side.setdefault(key, []).append(name)
    left, right = sides
    return [(left[key][0], right[key][0]) for key in left if len(left[key]) == len(right.get(key, ())) == 1]


def _twists(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return the columns of a forward speed and a turn rate that belong together."""
    by_owner: dict[frozenset[str], list[tuple[str, str]]] = {}
    for name in names:
        words = _words_of(name)
        if words & OTHER or words & ORIENTATION - {"rotation"}:
            continue
        axes = words & {"x", "y", "z"}
        is_forward = bool(words & FORWARD) and axes <= {"x"}
        is_turn = bool(words & TURN) and axes <= {"z"}
        if not words & (FORWARD | TURN):  # as LeKiwi has them: x.vel and theta.vel
            is_forward = {"x", "vel"} <= words and axes == {"x"}
            is_turn = bool(words & {"theta", "yaw", "th"} and words & {"vel", "rate"})
        if is_forward == is_turn:
            continue
        owner = _owner(words, FORWARD, TURN, SPEED, {"x", "z", "theta", "yaw", "th"})
        owner |= {"odometry"} if tokens_of(name).count("twist") > 1 else set()
        by_owner.setdefault(owner, []).append(("forward" if is_forward else "turn", name))
    pairs = []
    for members in by_owner.values():
        by_role = dict(members)
        if len(members) == len(by_role) == 2:
            pairs.append((by_role["forward"], by_role["turn"]))
    return pairs


def _rank(*names: str) -> int:
    """Return how likely columns are commands: 0 if they say so, 1 if they say nothing, 2 if they are measured."""
    tokens = [token for name in names for token in tokens_of(name)]
    if COMMANDED & set(tokens):
        return 0 if "cmd" in tokens and not MEASURED & set(tokens) else 1
    return 3 if MEASURED & set(tokens) or tokens.count("twist") > len(names) else 2


def _commands(path: Path, names: Sequence[str]) -> tuple[dict[str, Any] | None, tuple[str, str] | None]:
    """Return the commands, and the columns that they are from."""
    if {"/call/drive/move", "/call/drive/turn"} <= set(names):  # our own recordings
        pair = ("/call/drive/move", "/call/drive/turn")
        return {"forward": pair[0], "turn": pair[1], "unit": "share", "turn_unit": "share"}, pair
    candidates: list[tuple[int, tuple[str, str, str]]] = [
        (_rank(left, right), ("wheels", left, right))
        for left, right in _pairs(names)
        if not COUNTED & _words_of(left) or COMMANDED & _words_of(left)
    ]
    candidates += [(_rank(forward, turn), ("twist", forward, turn)) for forward, turn in _twists(names)]
    candidates = [(rank, value) for rank, value in candidates if rank < 3]
    best = _only(path, "commands", candidates, lambda value: f"{value[1]} and {value[2]}")
    if best is None:
        return None, None
    kind, first, second = best
    if kind == "wheels":
        part = {"left": first, "right": second, "unit": _speed_unit(first)}
    else:
        rate = unit_in(second, "rad")
        rate = rate if rate == "rpm" else f"{rate}/s"
        part = {"forward": first, "turn": second, "unit": _speed_unit(first), "turn_unit": rate}
    return part, (first, second)


def _measured(names: Sequence[str]) -> tuple[str, str] | None:
    """Return the speeds that a robot measured of itself; None if the log has none."""
    return next(iter([*_twists(names), *_pairs(names)]), None)


def _wheels(path: Path, names: Sequence[str], commanding: tuple[str, str] | None) -> dict[str, Any] | None:
    candidates = [
        (int(not TICKS & _words_of(left)), (left, right))
        for left, right in _pairs(names)
        if COUNTED & _words_of(left) and (left, right) != commanding
    ]
    pair = _only(path, "encoders", candidates, " and ".join)
    if pair is None:
        return None
    words = _words_of(pair[0])
    default = (
        "ticks" if TICKS & words else "rad" if {"joint", "states"} & words and "position" in words else "m"
    )
    per = {"per": "row"} if INCREMENTS & words else {}
    return {"left": pair[0], "right": pair[1], "unit": unit_in(pair[0], default), **per}


def _poses(path: Path, names: Sequence[str]) -> dict[str, Any] | None:
    places: dict[frozenset[str], dict[str, list[str]]] = {}
    turns: dict[frozenset[str], dict[str, list[str]]] = {}
    headings: dict[frozenset[str], list[str]] = {}
    for name in names:
        tokens = tokens_of(name)
        words = set(tokens)
        if (
            words & (OTHER | COMMANDED | SPEED | {"linear", "lin", "angular", "ang"})
            or "[" in name.partition("/transform")[0]
        ):
            continue
        fused = [token for token in tokens if re.fullmatch("q[xyzw]", token)]
        axes = [token for token in tokens if token in AXES]
        if fused:
            turns.setdefault(_owner(words, set(fused)), {}).setdefault(fused[0][1], []).append(name)
        elif len(axes) == 1 and words & ORIENTATION:
            owner = _owner(words, ORIENTATION, set(axes))
            turns.setdefault(owner, {}).setdefault(axes[0], []).append(name)
        elif len(axes) == 1:
            places.setdefault(_owner(words, set(axes)), {}).setdefault(axes[0], []).append(name)
        elif not axes and len(words & HEADING) == 1:
            headings.setdefault(_owner(words, HEADING), []).append(name)
    candidates = [
        (0 if owner & TRUTH else 2 if owner & MEASURED else 1, owner)
        for owner, axes in places.items()
        if len(axes.get("x", ())) == len(axes.get("y", ())) == 1
    ]
    chosen = _only(
        path, "poses", candidates, lambda owner: " and ".join(places[owner][axis][0] for axis in "xy")
    )
    if chosen is None:
        return None
    x, y = (places[chosen][axis][0] for axis in "xy")
    part: dict[str, Any] = {"x": x, "y": y, "unit": unit_in(x, "m")}
    quaternion = turns.get(chosen, {})
    if all(len(quaternion.get(axis, ())) == 1 for axis in AXES):
        return part | {"quaternion": [quaternion[axis][0] for axis in AXES]}
    own = headings.get(chosen, [])
    if len(own) == 1:
        part |= {"heading": own[0], "heading_unit": unit_in(own[0], "rad")}
    return part


def _readings(names: Sequence[str]) -> dict[str, Any] | None:
    """Return the largest family of columns with a number at the end, such as ir0 to ir7."""
    families: dict[str, list[tuple[int, str]]] = {}
    for name in names:
        match = SENSOR.match(name)
        if match and SENSORS & set(re.sub(r"\d", " ", " ".join(tokens_of(name))).split()):
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


def _check_topics(source: Source, values: dict[str, Any]) -> None:
    """Leave out parts that are on several topics. Messages have the time of their recording or of their header."""
    for name in ("readings", "wheels"):
        part = values.get(name)
        columns = part and (part.get("sensors") or [part.get("left"), part.get("right")])
        if columns and all(str(column).endswith("/range") for column in columns):
            continue
        topics = {str(column).split("/")[1 if name == "wheels" else -2] for column in columns or ()}
        if len(topics) > 1:
            del values[name]
    if "commands" not in values and "wheels" not in values:
        raise LogError(
            f"{source.path}: its wheels are on several topics. Write a mapping next to it, {map_name(source.path)}."
        )
