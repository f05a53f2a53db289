"""Descriptions whose numbers have dotted names and may be distributions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Self

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel, Field, model_validator

from realitygap.errors import did_you_mean
from realitygap.kernels.sim.shape import ANGLES
from realitygap.settings import Settings, table_in

from ._distribution import KINDS, Distribution

INCH = 0.0254  # [m]

UNITS = {
    "_mm": lambda value: value / 1000,
    "_cm": lambda value: value / 100,
    "_in": lambda value: value * INCH,
    "_deg": math.radians,
}
"""Units by the last part of a key in a file. Other keys are in meters or radians."""

ROWS = {
    "corner": ("x", "y"),
    "table": ("distance", "reading"),
    "wall": ("x1", "y1", "x2", "y2"),
    "tape": ("x1", "y1", "x2", "y2"),
}
"""Lists that a file may write as rows of plain numbers."""

SHORT = {"start": ("x", "y", "heading"), "goal": ("x", "y", "radius")}
"""Tables that a file may write as a list of plain numbers."""


class _IsNumber:
    """Marks the fields that have a dotted name and may be distributions."""


NUMBER = _IsNumber()
Number = Annotated[float, NUMBER]
Positive = Annotated[float, Field(gt=0), NUMBER]
NotNegative = Annotated[float, Field(ge=0), NUMBER]
Share = Annotated[float, Field(ge=0, le=1), NUMBER]


@dataclass(frozen=True)
class Limits:
    """The range of a number: from `least` to `most`. With `open_least`, the number must be larger than `least`."""

    least: float = -math.inf
    most: float = math.inf
    open_least: bool = False


class Described(Settings):
    """A description with numbers that have names, each a plain number or a distribution.

    A field's value is a plain float, and `vary` has the distributions of those that are drawn. If a distribution is
    given instead of a number, as in files, its center becomes the field's value and it goes to `vary`.
    """

    vary: dict[str, Distribution] = Field(
        default_factory=dict,
        description="Distributions of the numbers that are drawn, by dotted name. A file has them instead of numbers.",
        json_schema_extra={"hidden": True},
    )

    @model_validator(mode="before")
    @classmethod
    def _takes_distributions(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        plain, vary = _split(in_si(values), cls)
        return plain | ({"vary": vary | dict(plain.get("vary", {}))} if vary else {})

    @model_validator(mode="after")
    def _varies_within_limits(self) -> Self:
        numbers = dict(_walk(self))
        problems = []
        for name, drawn in list(self.vary.items()):
            if name not in numbers:
                problems.append(self._why_no_number(name, numbers).rstrip("."))
                continue
            try:
                self.vary[name] = _limited(name, drawn, numbers[name][1])
            except ValueError as error:
                problems.append(str(error))
        if problems:
            raise ValueError("\n".join(problems))
        return self

    @classmethod
    def _why_no_number(cls, name: str, known: Iterable[str]) -> str:
        if _is_fixed(cls, name.split(".")):
            return (
                f"{name}: the same in all trials, and no number that has a name. Give its value in the file."
            )
        return f"{name}: no number of this name. {did_you_mean(name, known)}"

    def numbers(self) -> dict[str, float | Distribution]:
        """Return every number by its dotted name, in the order of the description."""
        return {name: self.vary.get(name, value) for name, (value, _) in _walk(self)}

    def centers(self) -> dict[str, float]:
        """Return every number by its dotted name; of those that are drawn, the centers."""
        numbers = self.numbers().items()
        return {name: value.center if isinstance(value, Distribution) else value for name, value in numbers}

    def limits(self) -> dict[str, Limits]:
        """Return the range of every number, by dotted name."""
        return {name: limits for name, (_, limits) in _walk(self)}

    def with_numbers(self, values: Mapping[str, float | Distribution | Mapping[str, Any]]) -> Self:
        """Return the same object with other numbers.

        Args:
            values: Numbers, distributions or these as plain values, by dotted name.

        Raises:
            ValueError: There is no such number, or it cannot be this; every mistake.
        """
        known = dict(_walk(self))
        problems = []
        tree = self.to_dict()
        vary = tree.pop("vary", {})
        for name, value in values.items():
            if name not in known:
                problems.append(self._why_no_number(name, known))
                continue
            try:
                drawn = _distribution(name, value) if isinstance(value, Mapping) else value
                if isinstance(drawn, Distribution):
                    drawn = _limited(name, drawn, known[name][1])
            except ValueError as error:
                problems.append(f"{error}.")
                continue
            vary.pop(name, None)
            if isinstance(drawn, Distribution):
                vary[name], drawn = drawn, drawn.center
            _set(tree, name.split("."), drawn)
        try:
            made = type(self)(**tree, vary=vary)
        except ValueError as error:
            problems += str(error).split("\n")
        if problems:
            raise ValueError("\n".join(problems))
        return made

    def to_dict(self) -> dict[str, Any]:
        """Return the description as plain values; `from_dict` makes it again."""
        values = self.model_dump(mode="json", exclude={"vary"})
        return values | (
            {"vary": {name: drawn.to_dict() for name, drawn in self.vary.items()}} if self.vary else {}
        )

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the description that `to_dict` made plain.

        Raises:
            ValueError: It is none; every mistake with its place.
        """
        return cls(**values)


def _distribution(place: str, values: Mapping[str, Any]) -> Distribution:
    """Make a distribution, or raise an error that names `place` in each mistake."""
    try:
        return Distribution(**values)
    except ValueError as error:
        lines = str(error).split("\n")
        raise ValueError(
            "\n".join(place + line.removeprefix("Distribution").rstrip(".") for line in lines)
        ) from None


def _walk(model: Settings, place: str = "") -> Iterator[tuple[str, tuple[float, Limits]]]:
    """Yield every number with its dotted name and limits."""
    for key, field in type(model).model_fields.items():
        value = getattr(model, key)
        if NUMBER in field.metadata:
            yield place + key, (value, _limits(field.metadata))
        elif isinstance(value, Settings):
            yield from _walk(value, f"{place}{key}.")
        elif isinstance(value, tuple):
            for k, part in enumerate(value):
                if isinstance(part, Settings):
                    yield from _walk(part, f"{place}{key}.{k}.")


def _is_fixed(model: type[BaseModel], path: Sequence[str]) -> bool:
    """Return whether a dotted name is that of a setting, or of a table of settings, which is the same in all trials."""
    field = model.model_fields.get(path[0]) if path else None
    if field is None:
        return False
    inner, is_list = table_in(field.annotation)
    rest = path[2:] if is_list else path[1:]
    return _is_fixed(inner, rest) if inner is not None and rest else NUMBER not in field.metadata


def _limits(metadata: Sequence[object]) -> Limits:
    least, most, is_open = -math.inf, math.inf, False
    for rule in metadata:
        match rule:
            case Ge(ge=int() | float() as end):
                least = float(end)
            case Gt(gt=int() | float() as end):
                least, is_open = float(end), True
            case Le(le=int() | float() as end) | Lt(lt=int() | float() as end):
                most = float(end)
    return Limits(least, most, is_open)


def _limited(name: str, drawn: Distribution, limits: Limits) -> Distribution:
    """Return a distribution that keeps a number's limits; a normal one is cut there.

    Raises:
        ValueError: It does not.
    """
    if drawn.normal is not None and not limits.least <= drawn.normal[0] <= limits.most:
        raise ValueError(f"{name}: expected a mean {_in_words(limits)}, got {drawn.normal[0]:g}")
    if drawn.normal is not None and drawn.lowest <= limits.least and limits.open_least:
        raise ValueError(
            f"{name}: a normal distribution reaches {limits.least:g}, and this number must be more. Add `least`"
        )
    if drawn.normal is not None:
        low = None if limits.least == -math.inf or drawn.least is not None else limits.least
        high = None if limits.most == math.inf or drawn.most is not None else limits.most
        cut = {key: end for key, end in (("least", low), ("most", high)) if end is not None}
        drawn = drawn.model_copy(update=cut)
    is_low = drawn.lowest <= limits.least if limits.open_least else drawn.lowest < limits.least
    if is_low or drawn.highest > limits.most:
        raise ValueError(
            f"{name}: expected numbers {_in_words(limits)}, got {drawn.lowest:g} to {drawn.highest:g}"
        )
    return drawn


def _in_words(limits: Limits) -> str:
    low = f"{'more than' if limits.open_least else 'of at least'} {limits.least:g}"
    high = f"at most {limits.most:g}"
    if limits.least == -math.inf:
        return high
    return low if limits.most == math.inf else f"{low} and {high}"


def _set(tree: Any, path: list[str], value: Any) -> None:
    for key in path[:-1]:
        tree = tree[int(key)] if isinstance(tree, list) else tree[key]
    tree[path[-1]] = value


def in_si(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of a file with the units that keys end in taken away: track_mm = 153 becomes track = 0.153.

    Raises:
        ValueError: A number is given twice, in two units, or an angle in a unit of lengths, or the other way round.
    """

    def plain(value: Any, place: str) -> Any:
        if isinstance(value, Mapping):
            converted: dict[str, Any] = {}
            for key, part in value.items():
                unit = next((unit for unit in UNITS if isinstance(key, str) and key.endswith(unit)), "")
                name = key.removesuffix(unit) if unit else key
                if unit and name != "width" and (unit == "_deg") != (name in ANGLES):
                    kind = "an angle: keep it in radians, or end it in _deg" if name in ANGLES else "no angle"
                    raise ValueError(f"{place}{key}: {name} is {kind}")
                if name in converted:
                    raise ValueError(f"{place}{name}: given twice, also as {key}. Keep one")
                number = _converted(part, unit)
                if name == "start" and isinstance(part, list | tuple):
                    number = [*number[:2], *part[2:]]  # the third number is a heading
                converted[name] = plain(number, f"{place}{name}.")
            return converted
        if isinstance(value, list | tuple):
            return [plain(part, f"{place}{k}.") for k, part in enumerate(value)]
        return value

    return dict(plain(values, ""))


def _converted(value: Any, unit: str) -> Any:
    if not unit or isinstance(value, bool):
        return value
    if isinstance(value, int | float):
        try:
            return UNITS[unit](value)
        except OverflowError:
            return math.inf
    if isinstance(value, list | tuple):
        return [_converted(part, unit) for part in value]
    if isinstance(value, Mapping):
        return {key: part if key == "per" else _converted(part, unit) for key, part in value.items()}
    return value


def _split(
    values: Mapping[str, Any], model: type[BaseModel]
) -> tuple[dict[str, Any], dict[str, Distribution]]:
    """Return values with every distribution replaced by its center, and the distributions by dotted name.

    One in the place of what is the same in all trials stays, and its field says what it expects.

    Raises:
        ValueError: A distribution is none; every mistake.
    """
    vary: dict[str, Distribution] = {}
    problems: list[str] = []

    def plain(value: Any, place: str) -> Any:
        is_drawn = isinstance(value, Distribution) or (isinstance(value, Mapping) and set(value) & set(KINDS))
        if is_drawn and _is_fixed(model, place.split(".")):
            return value
        if is_drawn and isinstance(value, Mapping):
            try:
                value = _distribution(place, value)
            except ValueError as error:
                problems.append(str(error))
                return 1.0
        if isinstance(value, Distribution):
            vary[place] = value
            return value.center
        if isinstance(value, Mapping):
            return {key: plain(part, f"{place}.{key}") for key, part in value.items()}
        if isinstance(value, list | tuple):
            if place in SHORT and len(value) == len(SHORT[place]):
                return plain(dict(zip(SHORT[place], value, strict=True)), place)
            names = ROWS.get(place.rsplit(".", 1)[-1])
            return [plain(_row(part, names), f"{place}.{k}") for k, part in enumerate(value)]
        return value

    numbers = {key: value if key == "vary" else plain(value, key) for key, value in values.items()}
    if problems:
        raise ValueError("\n".join(problems))
    return numbers, vary


def _row(value: Any, names: tuple[str, ...] | None) -> Any:
    is_row = names is not None and isinstance(value, list | tuple) and len(value) == len(names)
    return dict(zip(names, value, strict=True)) if is_row and names else value
