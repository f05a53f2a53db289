"""The platforms by name: those of realitygap, those of other packages, and those of one Python file."""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping
from typing import NamedTuple

from realitygap.errors import StudyError, did_you_mean
from realitygap.robot_families import load, own_families, points_in, robot_families, source_of

from ._platform import Platform

GROUP = "realitygap.platforms"
"""Group of entry points by which packages add platforms: a name, and a subclass of `Platform`."""

RESERVED = frozenset(
    {
        *("python", "platform", "study", "report", "trials", "condition", "arena", "task", "neat", "novelty"),
        *("archive", "controller"),
        *("name", "selection", "noise", "seed", "pair", "on", "baseline", "change"),
        *("published", "published_source"),
    }
)
"""Names that study files use for something else."""

_SIMULATORS = {
    "jyro": f"{__package__}.jyro._platform:JyroPlatform",
    "sim": f"{__package__}.sim._platform:SimPlatform",
    "twin": f"{__package__}.twin._platform:TwinPlatform",
}
_RECORDED = {"recorded": f"{__package__}._recorded:RecordedPlatform"}


@functools.cache
def _built_in() -> Mapping[str, str]:
    """Return the reference to the class of each platform that comes with realitygap."""
    robots = [family.platforms for family in own_families()]
    return {**_SIMULATORS, **{name: of for each in robots for name, of in each.items()}, **_RECORDED}


def built_in_platforms() -> tuple[type[Platform], ...]:
    """Return the classes of the platforms that come with realitygap."""
    return tuple(platform_class(name) for name in _built_in())


def study_platforms() -> tuple[str, ...]:
    """Return the names of the platforms that a condition of a study can be on."""
    return (*(model.name for model in built_in_platforms() if model.is_for_studies), *sorted(_plugins()))


def emulated_robots() -> tuple[str, ...]:
    """Return how users name an emulated robot in this program, for each family of robots that has one."""
    return tuple(family.named(family.emulated) for family in robot_families() if family.emulated)


def emulated_robot(name: str) -> str:
    """Return how users name an emulated robot of a platform in this program; empty if there is none."""
    return next((spec for spec in emulated_robots() if spec.partition(":")[0] == name), "")


def platform_names() -> tuple[str, ...]:
    """Return the names of all platforms; those of other packages after ours."""
    return (*_built_in(), *sorted(_plugins()))


def platform_class(name: str) -> type[Platform]:
    """Return the class of a platform by its name, without anything after a colon.

    A package that adds a platform is imported only when its platform is named.

    Raises:
        StudyError: There is no such platform, its package cannot be used, or two packages add it.
    """
    if name in _built_in():
        built_in: type[Platform] = load(_built_in()[name])
        return built_in
    offers = _plugins().get(name)
    if offers is None:
        raise StudyError(f"There is no platform {name!r}. {did_you_mean(name, platform_names())}")
    if len(offers) > 1:
        packages = " and ".join(sorted(offer.source for offer in offers))
        raise StudyError(f"{packages} both add a platform {name!r}. Remove one.")
    (offer,) = offers
    try:
        found = load(offer.reference)
    except (Exception, SystemExit) as error:  # whatever an outside package does
        raise StudyError(
            f"Platform {name!r} of {offer.source} cannot be imported: {type(error).__name__}: {error}."
        ) from error
    return _checked(found, name, offer.source)


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


class _Offer(NamedTuple):
    """A platform of another package: the reference to its class, and the package with its version."""

    reference: str
    source: str


def _plugins() -> Mapping[str, list[_Offer]]:
    """Return the platforms of other packages by name, none of which is imported; names of ours are left out."""
    return _plugins_on(tuple(sys.path))


@functools.lru_cache(maxsize=4)
def _plugins_on(path: tuple[str, ...]) -> Mapping[str, list[_Offer]]:
    """Return the plugins on a path of modules, cached."""
    offers = [(point.name, _Offer(point.value, source_of(point))) for point in points_in(GROUP)]
    for family in robot_families():
        offers += [(name, _Offer(reference, family.source)) for name, reference in family.platforms.items()]
    plugins: dict[str, list[_Offer]] = {}
    for name, offer in offers:
        others = plugins.setdefault(name, [])
        if name not in _built_in() and all(offer.reference != other.reference for other in others):
            others.append(offer)
    return {name: others for name, others in plugins.items() if others}
