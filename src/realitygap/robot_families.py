"""Families of robots: how one is described, and where descriptions are found.

A family is one package with everything about robots of one protocol: driver, emulator, platforms, and robot files. Its
`RobotFamily` is all that other code needs to know, and nothing is imported before it is needed. Ours are the folders of
`realitygap.families`. Others register by the entry point group `realitygap.robots`, with the name of the family.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, NamedTuple, cast

from realitygap.errors import RobotError

GROUP = "realitygap.robots"
"""Group of entry points by which packages add families. An entry point has a family's name, and its `RobotFamily`."""


class Reading(NamedTuple):
    """A sensor as pages show it.

    Attributes:
        name: Name of the sensor.
        scale: Its readings in words.
        maximum: Its largest reading.
    """

    name: str
    scale: str
    maximum: float


@dataclass(frozen=True, kw_only=True)
class NetworkProgram:
    """A format in which robots of a family run a network without a computer.

    Attributes:
        ending: Ending of its files, without a dot.
        write: Reference to a function of a network, its interface, and the keywords `steps`, `step_s`, and `origin`,
            which returns the program in ASCII.
    """

    ending: str
    write: str


@dataclass(frozen=True, kw_only=True)
class RobotFamily:
    """The description of a family of robots.

    A reference is `module:attribute`, or a module; it is imported when it is first needed.

    Attributes:
        name: Word before the colon of a port, such as `NAME:/dev/ttyACM0`.
        noun: The robot in a sentence, without an article.
        package: Package of the family. Its folder `robots` holds the robot files.
        platforms: Reference to the class of each of its platforms, by name.
        terminal: Module with the functions of `realitygap.robots.Terminal`.
        ports: Examples of its ports, without the name before them.
        port_files: Options of its ports that name files, besides `arena`.
        addresses: Regular expression of its ports, without their options, that are addresses in a network. Others are
            devices, sockets, or emulators.
        emulated: Port of an emulated robot in this program; empty if there is none.
        emulators: Reference to the class of the port, by host of an `emulator://HOST` address.
        emulate: Reference to the command `realitygap emulate NAME`; empty if there is none.
        lacks: Reference to a function that returns why no robot can be emulated here, or nothing; empty if one always
            can.
        builds: Reference to a function that compiles a program and returns its path, by the name of the program in
            `realitygap twin build-NAME`.
        programs: Formats of programs that compute a network on its robots, by name.
        robot: Name of the robot file that calibrations of its robots build on.
        additions: Names of files in `robots/additions` that a robot can be equipped with, at most one of each group.
        range_readings: Range sensors by their number, for pages. Default: none is shown.
        channel_readings: Other sensors, by kinds such as `light` and `line`, for pages.
        is_default: True for the family of ports without a name before them.
        source: Package that adds it, with its version; filled in when it is found.
    """

    name: str
    noun: str
    package: str
    platforms: Mapping[str, str]
    terminal: str
    ports: tuple[str, ...]
    port_files: tuple[str, ...] = ()
    addresses: str = ""
    emulated: str = ""
    emulators: Mapping[str, str] = field(default_factory=dict)
    emulate: str = ""
    lacks: str = ""
    builds: Mapping[str, str] = field(default_factory=dict)
    programs: Mapping[str, NetworkProgram] = field(default_factory=dict)
    robot: str = ""
    additions: tuple[tuple[str, ...], ...] = ()
    range_readings: Mapping[int, tuple[Reading, ...]] = field(default_factory=dict)
    channel_readings: Mapping[str, tuple[Reading, ...]] = field(default_factory=dict)
    is_default: bool = False
    source: str = ""

    def named(self, port: str) -> str:
        """Return a port with the name of the family before it."""
        return f"{self.name}:{port}"

    def as_typed(self, port: str) -> str:
        """Return a port as users write it: the default family's need no name before them."""
        return port if self.is_default else self.named(port)

    def lack(self) -> str:
        """Return why no robot can be emulated here; empty if one can."""
        if not self.emulated:
            return f"There is no emulator for a {self.noun}."
        return str(load(self.lacks)()) if self.lacks else ""

    def robot_folder(self) -> Traversable:
        """Return the folder with its robot files, which need not exist."""
        return files(self.package) / "robots"

    def robot_names(self) -> list[str]:
        """Return the names of its robots, with each way to equip them."""
        folder = self.robot_folder()
        if not folder.is_dir():
            return []
        names = [
            entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
        ]
        for group in self.additions:
            names += [f"{name}-{addition}" for name in names for addition in group]
        return sorted(names)


def load(reference: str) -> Any:
    """Return the module, or the attribute of a module, that a reference names."""
    module, _, attributes = reference.partition("[")[0].replace(" ", "").partition(":")
    loaded: Any = import_module(module)
    return functools.reduce(getattr, attributes.split("."), loaded) if attributes else loaded


def own_families() -> tuple[RobotFamily, ...]:
    """Return the families that come with realitygap; the default one first."""
    return _own()


def robot_families() -> tuple[RobotFamily, ...]:
    """Return all families; those of other packages after ours.

    Raises:
        RobotError: The package of a family cannot be used.
    """
    return (*_own(), *_others_on(tuple(sys.path)))


def default_family() -> RobotFamily:
    """Return the family of ports without a name before them."""
    return next(family for family in _own() if family.is_default)


def find_family(name: str) -> RobotFamily | None:
    """Return the family of that name; None if there is none."""
    own = next((family for family in _own() if family.name == name), None)
    return own or next((family for family in _others_on(tuple(sys.path)) if family.name == name), None)


def ports_in_words() -> str:
    """Return examples of ports of all families, for messages and help texts."""
    families = robot_families()
    ports = [
        family.as_typed(port) for family in families for port in (*family.ports, family.emulated) if port
    ]
    return f"{', '.join(ports[:-1])} or {ports[-1]}"


def port_platforms() -> str:
    """Return how users name the platforms of families, for help texts: NAME:PORT, or a name without a port.

    Other packages are not imported: their entry points have the names.
    """
    own = [
        family.named("PORT") if name == family.name else name
        for family in _own()
        for name in family.platforms
    ]
    return ", ".join([*own, *(f"{name}:PORT" for name in _names_of_others())])


def ports_by_family() -> str:
    """Return a sentence for each of our families with examples of its ports, and one for others, for help texts."""
    sentences = []
    for family in _own():
        ports = [family.as_typed(port) for port in (*family.ports, family.emulated) if port]
        sentences.append(f"Port of a {family.noun}: {', '.join(ports[:-1])} or {ports[-1]}.")
    if others := _names_of_others():
        sentences.append(f"Port of another robot: {', '.join(f'{name}:PORT' for name in others)}.")
    return " ".join(sentences)


def network_programs() -> dict[str, NetworkProgram]:
    """Return the formats of programs of all families, by name."""
    return {name: program for family in robot_families() for name, program in family.programs.items()}


@functools.cache
def _own() -> tuple[RobotFamily, ...]:
    folder = Path(__file__).with_name("families")
    names = [module.name for module in iter_modules([str(folder)]) if module.ispkg]
    families = [load(f"realitygap.families.{name}:FAMILY") for name in names]
    return tuple(sorted(families, key=lambda family: (not family.is_default, family.name)))


def points_in(group: str) -> EntryPoints:
    """Return the entry points of a group in all packages."""
    return _points_on(tuple(sys.path)).select(group=group)


@functools.lru_cache(maxsize=4)
def _points_on(path: tuple[str, ...]) -> EntryPoints:
    """Return all entry points on a path of modules, cached, because a search reads the names of all packages."""
    return cast("EntryPoints", entry_points())  # Python 3.11 has another class with the same methods


def _names_of_others() -> list[str]:
    """Return the names of families that other packages add, none of which is imported."""
    return sorted({point.name for point in points_in(GROUP)} - {family.name for family in _own()})


@functools.lru_cache(maxsize=4)
def _others_on(path: tuple[str, ...]) -> tuple[RobotFamily, ...]:
    """Return the families that other packages on a path of modules add, cached."""
    points: dict[str, EntryPoint] = {}
    taken = {family.name for family in _own()}
    for point in _points_on(path).select(group=GROUP):
        if point.name not in taken and points.setdefault(point.name, point).value != point.value:
            raise RobotError(
                f"{source_of(points[point.name])} and {source_of(point)} both add a robot family {point.name!r}. "
                "Remove one."
            )
    return tuple(_loaded(point) for _, point in sorted(points.items()))


def _loaded(point: EntryPoint) -> RobotFamily:
    try:
        family = point.load()
    except (Exception, SystemExit) as error:  # whatever an outside package does
        raise RobotError(
            f"Robot family {point.name!r} of {source_of(point)} cannot be imported: {type(error).__name__}: {error}."
        ) from error
    if not isinstance(family, RobotFamily) or family.name != point.name or family.is_default:
        raise RobotError(
            f"Robot family {point.name!r} of {source_of(point)} is {family!r}, expected a "
            f"realitygap.robot_families.RobotFamily with name={point.name!r} and is_default=False."
        )
    return replace(family, source=source_of(point))


def source_of(point: EntryPoint) -> str:
    """Return the package of an entry point with its version."""
    return f"package {point.dist.name} {point.dist.version}" if point.dist else point.value
