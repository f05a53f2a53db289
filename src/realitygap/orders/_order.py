"""The base of all orders."""

from __future__ import annotations

import functools
import inspect
import os
import re
from collections.abc import Collection, Iterator, Mapping
from contextlib import AbstractContextManager
from typing import Any, ClassVar, TypeVar

from pydantic import ConfigDict, model_validator

from realitygap._caller import as_given, called_by_function
from realitygap._toml import toml_table
from realitygap._version import __version__
from realitygap.errors import StudyError
from realitygap.settings import Settings

from ._field import OrderField, fields_of

OrderT = TypeVar("OrderT", bound="Order")

_NEWER = ("lock", "blind")
"""Switches that records of before lack. A record has them only if they are on, so that it equals one of before."""

Plain = bool | int | float | str | list[bool | int | float | str]
"""Values of messages and records."""


class OrderError(StudyError, ValueError):
    """An order has settings that are wrong, or that exclude each other.

    Args:
        problems: Message for each field, by its name: what is expected, and what was given. A message that begins with
            a letter in lower case follows the name of its field. Others are whole sentences.
        words: Words for fields in the message, by their names.
    """

    def __init__(self, problems: Mapping[str, str], words: Mapping[str, str] | None = None) -> None:
        self.problems = {name: as_given(text) for name, text in problems.items()}
        words = words or {}
        super().__init__(
            "\n".join(_sentence(words.get(name, name), text) for name, text in self.problems.items())
        )


def _sentence(name: str, text: str) -> str:
    """Return "--margin is -1, expected more than 0." for the name of a field and "expected more than 0, got -1."."""
    if match := re.fullmatch(r"(expected .*), got (.*)\.", text, re.DOTALL):
        return f"{name} is {match[2]}, {match[1]}."
    return f"{name}: {text}" if text[:1].islower() and not text.startswith(name) else text


def _with_help(text: str, field: OrderField | None, others: Collection[str]) -> str:
    """Return a message, with the meaning of a text if the value is none."""
    if field is None:
        return text
    number = f". Their number is n_{field.name}" if f"n_{field.name}" in others else ""
    return text.replace("a text in quotes", f"a text: {field.help.removesuffix('.')}{number}", 1)


class Order(Settings):
    """An operation with all its settings: the one description from which its command, function, and form derive.

    The docstring of an order is the help of its command: a summary, paragraphs, and paragraphs that begin with
    "Example:" or "In Python:".

    Raises:
        OrderError: A setting is unknown, missing, or out of range, or two of them exclude each other.
    """

    model_config = ConfigDict(defer_build=True)  # the help of a command needs no validation

    command: ClassVar[str]
    """Name of the command."""

    def __init__(self, **values: Any) -> None:
        with self.called_by_function():
            super().__init__(**values)
            if conflicts := dict(self.conflicts()):
                raise OrderError(conflicts)

    @classmethod
    def called_by_function(cls) -> AbstractContextManager[None]:
        """Let messages name settings by the fields, unless a command or a form made the order."""
        return called_by_function({word: field.name for field in cls.fields() for word in field.options})

    @classmethod
    def refusal(cls, found: list[tuple[str, str]]) -> ValueError:
        """Return the error for mistakes, with the place and the message of each."""
        fields = {field.name: field for field in cls.fields()}
        return OrderError({place: _with_help(text, fields.get(place), fields) for place, text in found})

    @model_validator(mode="before")
    @classmethod
    def _takes_paths_as_text(cls, values: dict[str, object]) -> dict[str, object]:
        return {
            name: os.fspath(value) if isinstance(value, os.PathLike) else value
            for name, value in values.items()
        }

    @classmethod
    def by_place(cls, *values: object) -> dict[str, object]:
        """Return the fields for values without names, which a function of the order takes first."""
        places = [field.name for field in cls.fields() if field.face.is_argument]
        if len(values) > len(places):
            raise TypeError(
                f"Got {len(values)} values without a name, expected at most {len(places)}: {places}."
            )
        return dict(zip(places, values, strict=False))

    def conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield the field and the message for each setting that others exclude."""
        yield from ()

    @classmethod
    @functools.cache
    def fields(cls) -> tuple[OrderField, ...]:
        """Return the fields."""
        return fields_of(cls)

    @classmethod
    def help_text(cls) -> str:
        """Return the help of the command."""
        return inspect.cleandoc(cls.__doc__ or "")

    def message(self) -> dict[str, Plain]:
        """Return plain values from which another process makes the order."""
        return self.model_dump(mode="json", exclude_none=True)

    def record(self) -> dict[str, Plain]:
        """Return the record of the order: plain values from which `read_order` makes it, without files to write."""
        outputs = {each.name for each in self.fields() if each.face.is_output}
        values = self.model_dump(mode="json", exclude=outputs, exclude_none=True)
        values = {name: value for name, value in values.items() if value is not False or name not in _NEWER}
        return {"command": self.command, "version": __version__, **values}

    def to_toml(self) -> str:
        """Return the record as a table of TOML."""
        return f"[order]\n{toml_table(self.record())}\n"

    def to_order(self, model: type[OrderT], **others: object) -> OrderT:
        """Return another kind of order, which has the settings of both kinds from this one, and others as named."""
        names = [field.name for field in model.fields() if getattr(self, field.name, None) is not None]
        return model(**{name: getattr(self, name) for name in names} | others)

    def words(self, leave_out: Collection[str] = ()) -> list[str]:
        """Return the words of the command for this order, without defaults, and without these options."""
        words = [self.command]
        for each in self.fields():
            value = getattr(self, each.name)
            is_default = value == each.default and not each.is_required
            if is_default or not set(each.options).isdisjoint(leave_out):
                continue
            for part in value if each.is_list else (value,):
                words += [str(part)] if each.face.is_argument else _option_words(each, part)
        return words


def _option_words(field: OrderField, value: object) -> list[str]:
    if field.kind is bool:
        return [field.word]
    return [f"{field.word}={value}"] if str(value).startswith("-") else [field.word, str(value)]
