"""The reference pages of robot and arena files that come from the code itself: every key, robot and arena."""

from __future__ import annotations

import math
import re
import tempfile
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
from annotated_types import Ge, Gt, Le, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from realitygap.drawing import Picture
from realitygap.families.ros2._wiring import Scan, Wiring
from realitygap.robots.twin import FAMILIES, TwinModel, family_rows, sample_twin, twin_picture
from realitygap.settings import is_hidden
from realitygap.world import (
    Arena,
    ArenaFile,
    Distribution,
    RobotModel,
    arena_names,
    arena_picture,
    load_arena,
    load_robot,
    model_picture,
    robot_names,
)

SHOWN_ROBOTS = (
    "scribbler-s2-fluke2",
    "scribbler-s2-fluke2-cardboard",
    "jyro",
    "pioneer",
    "khepera",
    "e-puck",
    "thymio",
)
ROBOT_AT = {"avoid": "khepera", "light": "khepera"}


def description_parts() -> dict[str, str]:
    """Parts of the pages by file name."""
    parts = {
        "parts/robot-keys.md": keys_of(RobotModel, "robot"),
        "parts/ros2-keys.md": "\n\n".join(
            ["## `[driver]` of a robot on ROS 2", table_of(Wiring), "## `[driver.scan]`", table_of(Scan)]
        ),
        "parts/arena-keys.md": keys_of(ArenaFile, "arena"),
        "parts/twin-keys.md": keys_of(TwinModel, "twin"),
        "parts/twin-families.md": twin_families(),
        "parts/distribution-keys.md": table_of(Distribution),
        "parts/robots.md": robots(),
        "parts/arenas.md": arenas(),
    }
    parts["parts/twin.svg"] = twin_picture(sample_twin("odd-body", 2)).to_svg()
    parts["parts/yard.svg"] = picture_of(load_arena(_yard())).to_svg()
    parts |= {f"parts/robot-{name}.svg": model_picture(load_robot(name)).to_svg() for name in SHOWN_ROBOTS}
    parts |= {f"parts/arena-{name}.svg": picture_of(load_arena(name)).to_svg() for name in arena_names()}
    return parts


def twin_families() -> str:
    """What every twin draws, and what each family draws besides or instead."""
    kinds = {"every": "what twins of all families but `same` draw, unless their family says otherwise"}
    kinds |= {name: family.meaning for name, family in FAMILIES.items()}
    parts = []
    for name, meaning in kinds.items():
        rows = [
            f"| `{row.number}` | {value_of(row.low)} | {value_of(row.high)} | {row.part if row.part != name else ''} |"
            for row in family_rows(name)
        ]
        table = ["| number | from | to | of |", "|---|---|---|---|", *rows] if rows else ["Nothing else."]
        parts += [f"## {name}", meaning[:1].upper() + meaning[1:] + ".", "\n".join(table)]
    return "\n\n".join(parts) + "\n"


def value_of(value: bool | float | str) -> str:
    """A value that a family draws."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, int | float) else f'`"{value}"`'


def _yard() -> Path:
    """The arena of the page on making one, as a file."""
    page = (Path(__file__).parent / "how-to" / "arena.md").read_text("utf-8")
    block = re.search(r"<!-- file: yard.toml -->\n```toml\n(.*?)```", page, re.DOTALL)
    if block is None:
        raise ValueError("docs/how-to/arena.md has no block yard.toml, which its picture shows.")
    file = Path(tempfile.mkdtemp()) / "yard.toml"
    file.write_text(block[1], "utf-8")
    return file


def picture_of(arena: Arena) -> Picture:
    """An arena with a robot of its size at the start."""
    return arena_picture(arena, load_robot(ROBOT_AT.get(arena.name, "scribbler-s2-fluke2")))


def keys_of(model: type[BaseModel], what: str) -> str:
    """Every key of a file: those of its own, then table by table."""
    parts = [f"## Of the {what} itself", table_of(model)]
    for name, inner, is_list in tables_in(model):
        head = f"[[{name}]]" if is_list else f"[{name}]"
        parts += [f"## `{head}`", (inner.__doc__ or "").strip().splitlines()[0], table_of(inner)]
    return "\n\n".join(parts) + "\n"


def tables_in(model: type[BaseModel]) -> Iterator[tuple[str, type[BaseModel], bool]]:
    """Tables of a file, and tables in these."""
    for key, info in model.model_fields.items():
        inner, is_list = inner_of(info.annotation)
        if inner is not None and not is_hidden(info) and not is_row(inner):
            yield key, inner, is_list
            yield from ((f"{key}.{name}", part, many) for name, part, many in tables_in(inner))


def is_row(model: type[BaseModel]) -> bool:
    """Whether a table is written as a row of numbers."""
    return model.__name__ in ("Corner", "Sample", "WallEntry", "TapeEntry")


def inner_of(annotation: Any) -> tuple[type[BaseModel] | None, bool]:
    """The table that a key's type is, may be or lists, and whether it lists it."""
    parts = [part for part in typing.get_args(annotation) if part not in (type(None), Ellipsis)]
    is_list = typing.get_origin(annotation) is tuple
    found = parts[0] if len(parts) == 1 else annotation
    return (found if isinstance(found, type) and issubclass(found, BaseModel) else None), is_list


def table_of(model: type[BaseModel]) -> str:
    """The keys of one table that hold values: what they may be, their default, what they mean."""
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for key, info in model.model_fields.items():
        inner, _ = inner_of(info.annotation)
        if (inner is None or is_row(inner)) and not is_hidden(info):
            rows.append(
                f"| `{key}` | {kind_of(info)} | {default_of(info)} | {escape(info.description or '')} |"
            )
    return "\n".join(rows)


def kind_of(info: FieldInfo) -> str:
    """What a key may be, in words."""
    inner, is_list = inner_of(info.annotation)
    if inner is not None:
        return f"rows \\[{', '.join(inner.model_fields)}\\]" if is_list else "a table"
    words = words_of(info.annotation)
    least = next((f"more than {r.gt:g}" for r in info.metadata if isinstance(r, Gt)), "")
    least = least or next((f"at least {r.ge:g}" for r in info.metadata if isinstance(r, Ge)), "")
    most = next((f"at most {round(r.le, 4):g}" for r in info.metadata if isinstance(r, Le)), "")
    if any(isinstance(rule, MaxLen | MinLen) for rule in info.metadata):
        least = most = ""
    limits = " and ".join(part for part in (least, most) if part)
    return f"{words}, {limits}" if limits else words


def words_of(annotation: Any) -> str:
    """A type in words."""
    origin = typing.get_origin(annotation)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(words_of(part) for part in typing.get_args(annotation) if part is not type(None))
    if origin is Literal:
        return ", ".join(f"`{value!r}`".replace("'", '"') for value in typing.get_args(annotation))
    if origin is tuple:
        parts = typing.get_args(annotation)
        if parts[-1] is Ellipsis:
            return "texts" if parts[0] is str else "numbers"
        return f"{len(parts)} {'texts' if parts[0] is str else 'numbers'}"
    if origin is dict:
        return "table"
    return {bool: "true or false", int: "whole number", float: "number", str: "text"}[annotation]


def default_of(info: FieldInfo) -> str:
    """What a key is when it is not given."""
    if info.is_required():
        return "none"
    value = info.default
    if value is None or value == () or value == "":
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, float):
        return f"{round(value, 4):g}"
    return (
        f"`{value!r}`".replace("'", '"')
        if isinstance(value, str)
        else str(value)
        if isinstance(value, int)
        else ""
    )


def robots() -> str:
    """The robots that come with realitygap: their figures, then some as pictures."""
    rows = [
        "| robot | size | full speed | track | command | range sensors | other sensors |",
        "|---|---|---|---|---|---|---|",
    ]
    rows += [robot_row(load_robot(name)) for name in robot_names()]
    shown = [
        f"### {name}\n\n{escape(load_robot(name).description)}\n\n"
        f"```{{image}} ../generated/parts/robot-{name}.svg\n:alt: {model_picture(load_robot(name)).description}\n```"
        for name in SHOWN_ROBOTS
    ]
    return "\n".join(rows) + "\n\n" + "\n\n".join(shown) + "\n"


def robot_row(robot: RobotModel) -> str:
    """One robot in figures."""
    across, up = np.ptp(np.array([point for part in robot.body for point in part.outline(step=0.01)]), axis=0)
    drive = robot.drive
    turns = math.isclose(across, up, rel_tol=1e-3)
    size = f"{1000 * across:.0f} mm across" if turns else f"{1000 * across:.0f} × {1000 * up:.0f} mm"
    track = f"{1000 * drive.track:.0f} mm" if drive.mixing == "wheels" else f"{drive.turn_rate:g} rad/s"
    kinds = "/".join(dict.fromkeys(sensor.response for sensor in robot.range))
    others = [(len(sensors), kind) for kind, sensors in robot.sensors.items() if kind != "range"]
    more = ", ".join(f"{n} {what}" for n, what in others if n) + (", encoders" if robot.encoder else "")
    return (
        f"| `{robot.name}` | {size} | {drive.speed:g} m/s | {track} | {robot.step_s:g} s "
        f"| {len(robot.range)} {kinds} | {more.removeprefix(', ')} |"
    )


def arenas() -> str:
    """The arenas that come with realitygap, each with its picture."""
    parts = []
    for name in arena_names():
        arena = load_arena(name)
        parts.append(
            f"### {name}\n\n```{{image}} ../generated/parts/arena-{name}.svg\n"
            f":alt: {picture_of(arena).description}\n```"
        )
    return "\n\n".join(parts) + "\n"


def escape(text: str) -> str:
    """Prose that Markdown leaves as it is."""
    for letter in "*<>|[]_":
        text = text.replace(letter, f"\\{letter}")
    return text
