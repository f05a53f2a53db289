"""The function of an order, which takes the order or its fields."""

from __future__ import annotations

import functools
import inspect
import os
import re
import textwrap
from collections.abc import Callable, Collection
from typing import Any, Concatenate, ParamSpec, TypeVar

from ._field import OrderField
from ._order import Order

OrderT = TypeVar("OrderT", bound=Order)
P = ParamSpec("P")
R = TypeVar("R")

_PLAIN = (str, os.PathLike, int, float, list, tuple, dict, type(None))
"""Types of values that a field may have, or that its check refuses."""


def takes_order(
    model: type[OrderT],
) -> Callable[[Callable[Concatenate[OrderT, P], R]], Callable[..., R]]:
    """Let a function whose first parameter is an order also take the fields of that order.

    Its signature and docstring get those of the fields. If another parameter of the function has the name of a field,
    it gets the values that are objects: an arena by name belongs to the order, an `Arena` does not.
    """
    fields = {field.name: field for field in model.fields()}

    def decorate(function: Callable[Concatenate[OrderT, P], R]) -> Callable[..., R]:
        _, *others = inspect.signature(function).parameters.values()
        own = {parameter.name for parameter in others}

        @functools.wraps(function)
        def call(*args: Any, **values: Any) -> R:
            if args and isinstance(args[0], model):
                return function(*args, **values)
            values |= model.by_place(*args) if args else {}
            rest = {
                name: values.pop(name)
                for name in own & set(values)
                if name not in fields or not isinstance(values[name], _PLAIN)
            }
            with model.called_by_function():
                return function(model(**values), **rest)  # type: ignore[call-arg]

        parameters = [_parameter(field) for field in fields.values()]
        parameters += [parameter for parameter in others if parameter.name not in fields]
        _describe(
            call, inspect.Signature(parameters), _docstring(model, inspect.cleandoc(function.__doc__ or ""))
        )
        return call

    return decorate


def with_fields(
    model: type[Order], *, without: Collection[str] = ()
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Show the fields of an order in place of `**options` in the signature and the docstring of a function.

    Args:
        model: The order.
        without: Fields that the function has as parameters of other names, or that it does not need.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function, eval_str=True)
        *own, _ = signature.parameters.values()
        names = {parameter.name for parameter in own} | set(without)
        fields = [field for field in model.fields() if field.name not in names]

        @functools.wraps(function)
        def call(*args: P.args, **values: P.kwargs) -> R:
            return function(*args, **values)

        parameters = [*own, *(field.parameter for field in fields)]
        before, heading, after = inspect.cleandoc(function.__doc__ or "").partition("\n\nRaises:")
        documentation = "\n".join([before, *map(_argument, fields)]) + heading + after
        _describe(call, signature.replace(parameters=parameters), documentation)
        return call

    return decorate


def _describe(function: Callable[..., Any], signature: inspect.Signature, documentation: str) -> None:
    """Set what help, editors, and Typer show of a function made from an order."""
    vars(function).pop("__wrapped__", None)  # its source has other defaults than the signature
    function.__signature__ = signature  # type: ignore[attr-defined]
    function.__doc__ = documentation


def _argument(field: OrderField) -> str:
    """Return the entry of a field in the arguments of a docstring."""
    text = f"{field.name}: {_help(field)}"
    return textwrap.fill(text, 116, initial_indent="    ", subsequent_indent="        ")


def _parameter(field: OrderField) -> inspect.Parameter:
    """Return the parameter of a field. Those of arguments of the command are positional."""
    place = inspect.Parameter.POSITIONAL_OR_KEYWORD
    return field.parameter.replace(kind=place) if field.face.is_argument else field.parameter


def _docstring(model: type[Order], own: str) -> str:
    """Return the function's docstring with the paragraphs and the fields of the order."""
    paragraphs = model.help_text().split("\n\n")
    about = [text for text in paragraphs[1:] if not text.startswith(("Example:", "In Python:"))]
    arguments = map(_argument, model.fields())
    before, _, after = own.partition("Args:\n")
    return "\n\n".join([before.strip(), *about, "Args:\n" + "\n".join([*arguments, after])])


def _help(field: OrderField) -> str:
    """Return the help of a field with the names of fields in place of those of options, and quotes as code."""
    default = f" Default: {field.face.default_is}." if field.face.default_is else ""
    text = re.sub(r"--([a-z-]+)", lambda match: f"`{match[1].replace('-', '_')}`", field.help)
    return re.sub(r"'(\S+)'", r"`\1`", text) + default
