"""A field of an order, as its faces show it."""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, cast, get_args, get_origin

from pydantic import BaseModel, Field
from pydantic.fields import FieldInfo

Refers = Literal["", "platform", "file"]
"""Whether a text names a platform, or may name a file."""

_FACE = "face"


@dataclass(frozen=True)
class Face:
    """Properties of a field that its type, range, default, and help do not have.

    Attributes:
        metavar: Word for its value in the help of a command.
        names: Names on the command line. Default: the field's name with dashes.
        panel: Group of options in the help of a command.
        default_is: Default in words, if the field is empty by default.
        label: Label in a form; empty if forms do not show the field.
        refers: Whether its text names a platform, or may name a file.
        is_argument: True if the command takes it without the name of an option.
        is_output: True if it names a file to write. The record of an order leaves it out.
    """

    metavar: str = ""
    names: tuple[str, ...] = ()
    panel: str = ""
    default_is: str = ""
    label: str = ""
    refers: Refers = ""
    is_argument: bool = False
    is_output: bool = False


def option(
    default: object = ...,
    *,
    help: str,
    at_least: float | None = None,
    above: float | None = None,
    at_most: float | None = None,
    **face: str | bool | tuple[str, ...],
) -> Any:
    """Return a field of an order.

    Args:
        default: Default; none if the field has to be given.
        help: Help text, for commands, functions, and forms.
        at_least, above, at_most: Limits of a number.
        face: Values of `Face`.
    """
    Face(**face)  # type: ignore[arg-type]  # refuses a name that is none
    more = {_FACE: cast("Any", face)}
    return Field(default, description=help, ge=at_least, gt=above, le=at_most, json_schema_extra=more)


def argument(metavar: str, *, help: str, label: str = "", refers: Refers = "", default: object = ...) -> Any:
    """Return a field that a command takes without the name of an option, and that has to be given without a default."""
    return option(default, help=help, metavar=metavar, label=label, refers=refers, is_argument=True)


@dataclass(frozen=True)
class Limits:
    """Limits of a number.

    Attributes:
        low: Smallest number; None if there is none.
        high: Largest number; None if there is none.
        low_is_allowed: False if the number has to be above the smallest one.
        is_whole: True if the number is a whole one.
    """

    low: float | None = None
    high: float | None = None
    low_is_allowed: bool = True
    is_whole: bool = True

    @property
    def words(self) -> str:
        """The numbers in words, such as "a whole number from 2 to 1024"."""
        kind = "a whole number" if self.is_whole else "a number"
        if self.low is None:
            return kind if self.high is None else f"{kind} of at most {self.high:.10g}"
        if not self.low_is_allowed:
            return f"{kind} above {self.low:.10g}" + (
                "" if self.high is None else f", up to {self.high:.10g}"
            )
        low = f"{self.low:.10g}"
        return f"{kind} of at least {low}" if self.high is None else f"{kind} from {low} to {self.high:.10g}"

    def allow(self, value: float) -> bool:
        """Return whether a number is within the limits."""
        is_above = self.low is None or value > self.low or (self.low_is_allowed and value == self.low)
        is_below = self.high is None or value <= self.high
        return is_above and is_below and (not self.is_whole or value == int(value))


@dataclass(frozen=True)
class OrderField:
    """A field of an order.

    Attributes:
        name: Its name.
        kind: Type of its value, or of each of several.
        choices: Allowed texts; empty if any is allowed.
        is_optional: True if it may be empty, which is None.
        is_list: True if it has several values.
        is_required: True if it has no default.
        default: Default value.
        help: Help text, without the default.
        limits: Limits of a number.
        face: Other properties.
    """

    name: str
    kind: type[bool | int | float | str | Path]
    choices: tuple[str, ...]
    is_optional: bool
    is_list: bool
    is_required: bool
    default: Any
    help: str
    limits: Limits
    face: Face

    @property
    def parameter(self) -> inspect.Parameter:
        """Parameter of a function, by name only."""
        annotation: Any = Literal[self.choices] if self.choices else self.kind
        annotation = list[annotation] if self.is_list else annotation
        annotation = annotation | None if self.is_optional else annotation
        default = inspect.Parameter.empty if self.is_required else self.default
        return inspect.Parameter(
            self.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
        )

    @property
    def options(self) -> tuple[str, ...]:
        """Names on the command line; empty for an argument."""
        return () if self.face.is_argument else self.face.names or (f"--{self.name.replace('_', '-')}",)

    @property
    def word(self) -> str:
        """Word for the field in messages of a command."""
        return self.face.metavar if self.face.is_argument else max(self.options, key=len)


def fields_of(model: type[BaseModel]) -> tuple[OrderField, ...]:
    """Return the fields of an order, in their order."""
    return tuple(_field(name, info) for name, info in model.model_fields.items())


def _field(name: str, info: FieldInfo) -> OrderField:
    kind, choices, is_optional, is_list = _parts(info.annotation)
    constraints = info.metadata
    if get_origin(kind) is Annotated:  # of each of several values
        kind, inner = get_args(kind)
        constraints = inner.metadata
    extra = info.json_schema_extra if isinstance(info.json_schema_extra, Mapping) else {}
    return OrderField(
        name=name,
        kind=kind,
        choices=choices,
        is_optional=is_optional,
        is_list=is_list,
        is_required=info.is_required(),
        default=None if info.is_required() else info.default,
        help=info.description or "",
        limits=_limits(constraints, is_whole=kind is int),
        face=Face(**cast("Any", extra.get(_FACE, {}))),
    )


def _limits(constraints: Iterable[object], *, is_whole: bool) -> Limits:
    ends = {
        end: getattr(each, end) for each in constraints for end in ("ge", "gt", "le") if hasattr(each, end)
    }
    return Limits(ends.get("ge", ends.get("gt")), ends.get("le"), "gt" not in ends, is_whole)


def _parts(annotation: Any) -> tuple[Any, tuple[str, ...], bool, bool]:
    """Return the type of a value, its choices, whether it may be None, and whether there are several."""
    if get_origin(annotation) in (typing.Union, types.UnionType):
        (rest,) = (each for each in get_args(annotation) if each is not type(None))
        kind, choices, _, is_list = _parts(get_args(rest)[0] if get_origin(rest) is Annotated else rest)
        return kind, choices, True, is_list
    if get_origin(annotation) is Literal:
        return str, get_args(annotation), False, False
    if get_origin(annotation) is tuple:
        kind, choices, _, _ = _parts(get_args(annotation)[0])
        return kind, choices, False, True
    return annotation, (), False, False
