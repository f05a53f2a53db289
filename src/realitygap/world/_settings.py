"""The settings for the arena of a study and for the start of trials."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)

from realitygap.errors import DescriptionError
from realitygap.settings import Settings

from ._arena import MOST_ROBOTS, NAMED_STARTS, Arena, Pose, paper_arena
from ._library import arena_names, load_arena
from ._placing import roomiest_starts
from ._walls import enclosing_walls, is_inside

StartName = Literal["corner", "center", "left"]


class ArenaSettings(Settings):
    """The arena of a study."""

    preset: str = Field(
        "paper",
        description="Name of the arena. paper: 42 x 24 in, cells of 3 in, the inner 12 x 6 reachable (section 2.1). "
        "`realitygap show arena` draws arenas. The page on arena files lists them.",
    )
    read: dict[str, Any] | None = Field(
        None,
        description="The arena as it was read from the file, so that results need no file.",
        json_schema_extra={"hidden": True},
        repr=False,
    )
    file: str = Field(
        "",
        description="Your own arena file, TOML or SVG, instead of a name. The path is relative to the study file. The "
        "results include the arena itself.",
    )
    start: StartName | Annotated[list[float], Field(min_length=3, max_length=3)] = Field(
        "corner",
        description="Start of trials: a name, or [x, y, heading] in meters and radians from +x, counter-clockwise. "
        "corner: (0.1905, 0.1905) facing +x, the center of a cell. center: the arena's center, on a junction of cells; "
        "it counts for the upper right cell. left: middle of the left side, on a border of cells; it counts for the "
        "upper cell. The paper states only that the start is always the same. Names are only for the paper's arena. "
        "The file of another arena gives its start.",
    )

    robots: int = Field(
        1,
        ge=1,
        le=MOST_ROBOTS,
        description="Number of robots that are together in the arena, on platform sim. They collide, and their range "
        "sensors see each other. Coverage counts the cells that any of them visits. Other tasks score each robot and "
        "use the mean.",
    )
    other_starts: list[Annotated[list[float], Field(min_length=3, max_length=3)]] = Field(
        default_factory=list,
        description="Starts of the robots after the first, [x, y, heading] each. Default: each robot starts at the "
        "center of the cell with the most room, with the heading of the first robot.",
    )

    networks: Literal["one", "each"] = Field(
        "one",
        description="Networks of several robots. one: all robots have the same network, whose fitness is that of the "
        "team. each: every robot has another network of the generation. Each network drives once from each start, with "
        "random partners. Its fitness is the mean of these trials (Waibel, Keller & Floreano 2009: homogeneous and "
        "heterogeneous teams with team-level selection).",
    )

    @model_validator(mode="before")
    @classmethod
    def _reads_its_file(cls, values: Any) -> Any:
        """Take the start from the file, and store its content and its bare name, which is the same everywhere."""
        if not isinstance(values, Mapping):
            return values
        values = dict(values)
        file, preset = values.get("file", ""), values.get("preset", "paper")
        if isinstance(file, str) and file and values.get("read") is None:
            arena = _read(file)
            if arena is not None:
                values |= {"file": Path(file).name, "read": arena.to_dict()}
        elif values.get("read") is not None:
            arena = Arena.from_dict(values["read"])
        else:
            arena = load_arena(preset) if preset in arena_names() else None
        if arena is not None and "start" not in values and (file or preset != "paper"):
            values["start"] = list(arena.start)
        return values

    @field_validator("preset")
    @classmethod
    def _is_known(cls, preset: str) -> str:
        if preset not in arena_names():
            hint = f". Name a file by file = {preset!r}" if preset.endswith(".toml") else ""
            raise ValueError(f"expected {', '.join(arena_names())}{hint}")
        return preset

    @field_validator("file")
    @classmethod
    def _was_read(cls, file: str, info: ValidationInfo) -> str:
        if file and info.data.get("read") is None:
            try:
                load_arena(_as_path(file))
            except DescriptionError as error:
                raise ValueError(str(error).rstrip(".")) from None
        if file and info.data.get("preset") != "paper":
            raise ValueError("expected preset or file and not both")
        return file

    @field_validator("start")
    @classmethod
    def _begins_inside(cls, start: StartName | list[float], info: ValidationInfo) -> StartName | list[float]:
        if "preset" not in info.data or "file" not in info.data:
            return start  # what is wrong is said of these
        arena = _arena_of(info.data["preset"], info.data["read"])
        if isinstance(start, str):
            if info.data["read"] is not None or arena.name != "paper":
                raise ValueError(
                    "is only for the paper's arena. Remove it to start where the arena says, or write [x, y, heading]"
                )
            return start
        x, y, heading = start
        if enclosing_walls(arena.walls) and not is_inside(arena, x, y):
            xs = [x for wall in arena.walls for x in wall[::2]]
            ys = [y for wall in arena.walls for y in wall[1::2]]
            raise ValueError(
                f"start lies outside the arena: expected {min(xs):g} < x < {max(xs):g} and {min(ys):g} < y < "
                f"{max(ys):g} [m]"
            )
        if abs(heading) > 2 * math.pi:
            raise ValueError("heading is in radians, expected -2 pi to 2 pi")
        return start

    @model_serializer(mode="wrap")
    def _without_what_is_not_there(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out newer settings that have their defaults, so that older conditions keep their hashes."""
        values: dict[str, Any] = handler(self)
        unused: dict[str, Any] = {
            "file": "",
            "read": None,
            "robots": 1,
            "other_starts": [],
            "networks": "one",
        }
        return {key: value for key, value in values.items() if key not in unused or value != unused[key]}

    def pose(self) -> Pose:
        """Return the pose at which trials begin."""
        return (
            NAMED_STARTS[self.start]
            if isinstance(self.start, str)
            else Pose(self.start[0], self.start[1], self.start[2])
        )

    def arena(self) -> Arena:
        """Return the arena with the starts of all robots."""
        arena = self._arena_alone()
        if self.robots == 1:
            return arena
        given = tuple(Pose(x, y, heading) for x, y, heading in self.other_starts)
        return replace(arena, others=given or roomiest_starts(arena, self.robots - 1))

    def _arena_alone(self) -> Arena:
        if not self.file and self.preset == "paper":
            return paper_arena(self.pose())
        arena = _arena_of(self.preset, self.read)
        if arena.start == self.pose():
            return arena  # its start may be drawn
        vary = {name: drawn for name, drawn in arena.vary.items() if not name.startswith("arena.start.")}
        return replace(arena, start=self.pose(), vary=vary)


def _arena_of(preset: str, read: Mapping[str, Any] | None) -> Arena:
    """Return the arena that was read from a file, or the one of this name."""
    return Arena.from_dict(dict(read)) if read is not None else load_arena(preset)


def _read(file: str) -> Arena | None:
    """Return the arena of a file; None if it cannot be read, which the field's own check reports."""
    try:
        return load_arena(_as_path(file))
    except DescriptionError:
        return None


def _as_path(file: str) -> Path:
    """Return a path that is not mistaken for the name of an arena."""
    return Path(file) if file not in arena_names() else Path.cwd() / file
