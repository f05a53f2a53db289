"""Commands made from orders, and `realitygap again`, which repeats one."""

from __future__ import annotations

import inspect
import itertools
import os
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from realitygap._terminal import echo
from realitygap.orders import Order, OrderError, OrderField, read_order

from ._app import app_for

OrderT = TypeVar("OrderT", bound=Order)


def command_of(model: type[OrderT]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make a command of a function whose first parameter is an order, and whose others are options of the command only.

    The fields of the order are the arguments and the first options of the command. The docstring is that of the order.
    """

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        _, *own = inspect.signature(function, eval_str=True).parameters.values()
        fields = model.fields()

        def command(**values: Any) -> None:
            given = {field.name: values.pop(field.name) for field in fields}
            try:
                order = model(**given)
            except OrderError as error:
                raise OrderError(error.problems, {field.name: field.word for field in fields}) from None
            function(order, **values)

        parameters = [_parameter(field) for field in fields]
        parameters += [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in own]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        command.__doc__ = model.help_text()
        command.__name__, command.__module__ = function.__name__, function.__module__
        return command

    return decorate


def _parameter(field: OrderField) -> inspect.Parameter:
    """Return the parameter from which Typer makes an argument or option."""
    face = field.face
    help_text = f"{field.help} [default: {face.default_is}]" if face.default_is else field.help
    if face.is_argument:
        shown: Any = typer.Argument(metavar=face.metavar, help=help_text)
    else:
        shown = typer.Option(
            *field.options,
            metavar=face.metavar or None,
            help=help_text,
            min=field.limits.low if field.limits.low_is_allowed else None,
            max=field.limits.high,
            rich_help_panel=face.panel or None,
        )
    parameter = field.parameter
    return parameter.replace(annotation=Annotated[parameter.annotation, shown])


def _free_folder(folder: Path) -> Path:
    """Return the first of the names DIR-2, DIR-3, and so on, that is free."""
    folder = Path(os.path.normpath(folder))
    return next(
        path for n in itertools.count(2) if not (path := folder.with_name(f"{folder.name}-{n}")).exists()
    )


def again(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Report of a gap (.html), calibration (.toml), folder of results, or result of --json (.json).",
        ),
    ],
    options: Annotated[
        list[str] | None,
        typer.Argument(metavar="OPTIONS", help="Options of the command that replace those of the result."),
    ] = None,
) -> None:
    """Repeat a measurement from its result.

    A result states the command that made it, with all settings. This command runs it again, in the current folder, from
    which the names of files are resolved. New trials are driven, unless -o names a file or folder that has them. A
    folder DIR is repeated next to it, in DIR-2 or the next free name.

    Example: realitygap again gap.html

    Example: realitygap again fit.toml -o fit-2.toml

    Example: realitygap again gap.html --trials 20 --report gap-2.html

    In Python: realitygap.orders.read_order("gap.html")
    """
    order = read_order(file)
    given = {option.partition("=")[0] for option in options or ()}
    words = [*order.words(leave_out=given), *(options or ())]
    if file.is_dir() and given.isdisjoint(("-o", "--out")):
        words += ["--out", str(_free_folder(file))]
    echo(f"realitygap {shlex.join(words)}", err=True)
    app_for(words)(words, prog_name="realitygap")
