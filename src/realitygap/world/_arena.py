"""The arena: what does not move."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, NamedTuple

from realitygap.drawing import picture_of
from realitygap.errors import check_finite

from ._arena_file import ArenaFile
from ._described import INCH
from ._distribution import Distribution
from ._floor import BARE_FLOOR, Floor
from ._grid import Grid
from ._obstacle import Goal, Light, Obstacle, Segment

MOST_ROBOTS = 16
"""Robots in an arena at once, at most."""

PREFIX = "arena."


class Pose(NamedTuple):
    """The pose of a robot: x [m], y [m], heading [rad, counter-clockwise from +x]."""

    x: float
    y: float
    heading: float

    def point(self, ahead: float, left: float) -> tuple[float, float]:
        """Return the place in the arena of a point of the robot [m]."""
        sine, cosine = math.sin(self.heading), math.cos(self.heading)
        return self.x + ahead * cosine - left * sine, self.y + ahead * sine + left * cosine


@dataclass(frozen=True)
class Arena:
    """Straight walls, a grid of reachable cells, a start, and optional obstacles, lights, floor, and goal.

    Attributes:
        name: Name of the arena.
        walls: (w, 4) x1, y1, x2, y2 of each wall [m].
        grid: The reachable cells.
        start: Start of every trial.
        obstacles: Obstacles in it.
        lights: Lights in it.
        floor: Tape or image on the floor.
        goal: Goal to reach; None if there is none.
        vary: Numbers that are drawn, by dotted name ("arena.start.x"). The fields have their centers.
        others: Starts of the other robots, if several are in it.
    """

    name: str
    walls: tuple[tuple[float, float, float, float], ...]
    grid: Grid
    start: Pose
    obstacles: tuple[Obstacle, ...] = ()
    lights: tuple[Light, ...] = ()
    floor: Floor = BARE_FLOOR
    goal: Goal | None = None
    vary: Mapping[str, Distribution] = field(default_factory=dict, hash=False)
    others: tuple[Pose, ...] = ()

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))

    @property
    def starts(self) -> tuple[Pose, ...]:
        """Starts of all robots: that of the first one first."""
        return (self.start, *self.others)

    @property
    def n_robots(self) -> int:
        """Number of robots in it."""
        return 1 + len(self.others)

    @property
    def alone(self) -> Arena:
        """Return the same arena with one robot."""
        return replace(self, others=()) if self.others else self

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Walls and straight sides of obstacles, (w, 4) [m]."""
        return (*self.walls, *(edge for obstacle in self.obstacles for edge in obstacle.edges()))

    def straight_walls(self) -> tuple[Segment, ...]:
        """Return all walls and the sides of obstacles as straight walls, the only ones in Jyro, (w, 4) [m].

        Raises:
            ValueError: An obstacle is round, or a number is a distribution.
        """
        round_ones = [str(k) for k, obstacle in enumerate(self.obstacles) if obstacle.radius]
        if round_ones:
            raise ValueError(
                f"arena {self.name!r} has round obstacles ({', '.join(round_ones)}), expected straight walls, "
                "the only ones in Jyro. Use platform 'sim'"
            )
        if self.vary:
            raise ValueError(
                f"in arena {self.name!r} {', '.join(self.vary)} are drawn, expected plain numbers. Use platform 'sim'"
            )
        return self.segments

    def to_dict(self) -> dict[str, Any]:
        """Return the arena as plain values; of what may be there, only what is."""
        values: dict[str, Any] = {
            "name": self.name, "walls": self.walls, "grid": asdict(self.grid), "start": tuple(self.start)
        }  # fmt: skip
        if self.obstacles:
            values["obstacles"] = [asdict(obstacle) for obstacle in self.obstacles]
        if self.lights:
            values["lights"] = [asdict(light) for light in self.lights]
        if self.floor != BARE_FLOOR:
            values["floor"] = self.floor.to_dict()
        if self.goal is not None:
            values["goal"] = asdict(self.goal)
        if self.vary:
            values["vary"] = {name: drawn.to_dict() for name, drawn in self.vary.items()}
        if self.others:
            values["others"] = [tuple(pose) for pose in self.others]
        return values

    def numbers(self) -> dict[str, float | Distribution]:
        """Return every number that may be drawn, by its dotted name: "arena.start.x" and so on."""
        return {PREFIX + name: value for name, value in self._file().numbers().items()}

    def with_numbers(self, values: Mapping[str, float | Distribution | Mapping[str, Any]]) -> Arena:
        """Return the same arena with other numbers.

        Args:
            values: Numbers, distributions or these as plain values, by dotted name.

        Raises:
            ValueError: There is no such number, or it cannot be this; every mistake.
        """
        wrong = [
            f"{name}: expected a name that begins with {PREFIX!r}."
            for name in values
            if not name.startswith(PREFIX)
        ]
        if wrong:
            raise ValueError("\n".join(wrong))
        own = {name.removeprefix(PREFIX): value for name, value in values.items()}
        return replace(Arena.from_file(self._file().with_numbers(own)), others=self.others)

    def to_toml(self) -> str:
        """Return the file that keeps it; `load_arena` reads it.

        Raises:
            ValueError: It has a picture on its floor, which is a separate file, or numbers that are drawn.
        """
        return self._file().to_toml()

    def _file(self) -> ArenaFile:
        """Return the arena in the form of a file."""
        return ArenaFile(
            name=self.name,
            wall=[list(wall) for wall in self.walls],
            obstacle=[
                {"corner" if key == "corners" else key: value for key, value in asdict(obstacle).items()}
                for obstacle in self.obstacles
            ],
            light=[asdict(light) for light in self.lights],
            floor=self.floor.to_dict(),
            grid=asdict(self.grid),
            start=self.start._asdict(),
            goal=None if self.goal is None else asdict(self.goal),
            vary={name.removeprefix(PREFIX): drawn for name, drawn in self.vary.items()},
        )

    @classmethod
    def from_file(cls, file: ArenaFile) -> Arena:
        """Return the arena that a file describes."""
        return cls(
            file.name,
            tuple((wall.x1, wall.y1, wall.x2, wall.y2) for wall in file.wall),
            Grid(**file.resolved_grid().model_dump()),
            Pose(file.start.x, file.start.y, file.start.heading),
            tuple(entry.obstacle() for entry in file.obstacle),
            tuple(Light(light.x, light.y, light.strength) for light in file.light),
            file.floor.floor(),
            None if file.goal is None else Goal(file.goal.x, file.goal.y, file.goal.radius),
            {PREFIX + name: drawn for name, drawn in file.vary.items()},
        )

    def _repr_svg_(self) -> str:
        return picture_of(self).to_svg()

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Arena:
        """Return the arena that `to_dict` described."""
        obstacles = (
            Obstacle(**{**row, "corners": tuple((x, y) for x, y in row["corners"])})
            for row in values.get("obstacles", ())
        )
        return cls(
            values["name"],
            tuple((x1, y1, x2, y2) for x1, y1, x2, y2 in values["walls"]),
            Grid(**values["grid"]),
            Pose(*values["start"]),
            tuple(obstacles),
            tuple(Light(**row) for row in values.get("lights", ())),
            Floor.from_dict(values.get("floor", {})),
            Goal(**values["goal"]) if "goal" in values else None,
            {name: Distribution(**drawn) for name, drawn in values.get("vary", {}).items()},
            tuple(Pose(*pose) for pose in values.get("others", ())),
        )


def paper_arena(start: Pose | None = None) -> Arena:
    """Return the paper's arena: 42 x 24 in inside wooden blocks, cells of 3 in, the inner 12 x 6 reachable.

    Args:
        start: Start of trials, which the paper does not give. Default: (0.1905, 0.1905) m, the center of cell (1, 1),
            facing +x.

    Source: Rosenzweig & Remy, section 2.1 and Figure 2. Differs: exact inches, where the paper prints
    .609 x 1.07 m.
    """
    width, depth = 42 * INCH, 24 * INCH
    corners = [(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)]
    walls = tuple((*corners[k], *corners[(k + 1) % 4]) for k in range(4))
    grid = Grid(x=3 * INCH, y=3 * INCH, cell=3 * INCH, columns=12, rows=6)
    return Arena("paper", walls, grid, start or Pose(7.5 * INCH, 7.5 * INCH, 0.0))


NAMED_STARTS = {
    "corner": Pose(7.5 * INCH, 7.5 * INCH, 0.0),  # the center of cell (1, 1)
    "center": Pose(21 * INCH, 12 * INCH, 0.0),  # on a junction of cells: belongs to the upper right one
    "left": Pose(7.5 * INCH, 12 * INCH, 0.0),  # on a border of cells: belongs to the upper one
}
