"""The platforms by name: those of realitygap, those of other packages, and those of one Python file."""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points

from realitygap.errors import StudyError, did_you_mean

from ._platform import Platform

GROUP = "realitygap.platforms"
"""Group of entry points by which packages add platforms: a name, and a subclass of `Platform`."""

RESERVED = frozenset(
    {
        *("python", "platform", "study", "report", "trials", "condition", "arena", "task", "neat", "novelty"),
        "controller",
        *("name", "selection", "noise", "seed", "pair", "on", "baseline", "change"),
        *("published", "published_source"),
    }
)
"""Names that study files use for something else."""

_BUILT_IN = {
    "jyro": ".jyro._platform:JyroPlatform",
    "sim": ".sim._platform:SimPlatform",
    "twin": ".twin._platform:TwinPlatform",
    "scribbler": ".scribbler._platform:ScribblerPlatform",
    "thymio": ".thymio._platform:ThymioPlatform",
    "enki": ".enki._platform:EnkiPlatform",
    "recorded": ".recorded._platform:RecordedPlatform",
}


def built_in_platforms() -> tuple[type[Platform], ...]:
    """Return the classes of the platforms that come with realitygap."""
    return tuple(platform_class(name) for name in _BUILT_IN)


def study_platforms() -> tuple[str, ...]:
    """Return the names of the platforms that a condition of a study can be on."""
    return (*(model.name for model in built_in_platforms() if model.is_for_studies), *sorted(_plugins()))


def emulated_robots() -> tuple[str, ...]:
    """Return how users name an emulated robot in this program, for each platform that has one."""
    return tuple(model.emulated for model in built_in_platforms() if model.emulated)


def platform_names() -> tuple[str, ...]:
    """Return the names of all platforms; those of other packages after ours."""
    return (*_BUILT_IN, *sorted(_plugins()))


def platform_class(name: str) -> type[Platform]:
    """Return the class of a platform by its name, without anything after a colon.

    A package that adds a platform is imported only when its platform is named.

    Raises:
        StudyError: There is no such platform, its package cannot be used, or two packages add it.
    """
    if name in _BUILT_IN:
        module, _, attribute = _BUILT_IN[name].partition(":")
        built_in: type[Platform] = getattr(import_module(module, __package__), attribute)
        return built_in
    points = _plugins().get(name)
    if points is None:
        raise StudyError(f"There is no platform {name!r}. {did_you_mean(name, platform_names())}")
    if len(points) > 1:
        packages = " and ".join(sorted(map(_source, points)))
        raise StudyError(f"{packages} both add a platform {name!r}. Remove one.")
    (point,) = points
    try:
        found = point.load()
    except (Exception, SystemExit) as error:  # whatever an outside package does
        raise StudyError(
            f"Platform {name!r} of {_source(point)} cannot be imported: {type(error).__name__}: {error}."
        ) from error
    return _checked(found, name, _source(point))


def _checked(found: object, name: str, source: str) -> type[Platform]:
    if not (isinstance(found, type) and issubclass(found, Platform)):
        raise StudyError(
            f"Platform {name!r} of {source} is {found!r}, expected a subclass of realitygap.platforms.Platform."
        )
    own = getattr(found, "name", None)
    if own != name:
        raise StudyError(f"Platform {name!r} of {source} has the name {own!r}, expected {name!r}.")
    if not name.isidentifier() or name in RESERVED:
        raise StudyError(
            f"{source} adds a platform {name!r}, expected letters, digits and underscores, and no name of a setting."
        )
    found.version = found.version or source
    return found


def _plugins() -> Mapping[str, list[EntryPoint]]:
    """Return the entry points of other packages by name, none of which is imported; names of ours are left out."""
    return _plugins_on(tuple(sys.path))


@functools.lru_cache(maxsize=4)
def _plugins_on(path: tuple[str, ...]) -> Mapping[str, list[EntryPoint]]:
    """Return the plugins on a path of modules, cached, because each search reads the names of all packages."""
    plugins: dict[str, list[EntryPoint]] = {}
    for point in entry_points(group=GROUP):
        points = plugins.setdefault(point.name, [])
        if all(point.value != other.value for other in points):
            points.append(point)
    return {name: points for name, points in plugins.items() if name not in _BUILT_IN}


def _source(point: EntryPoint) -> str:
    return f"package {point.dist.name} {point.dist.version}" if point.dist else point.value
