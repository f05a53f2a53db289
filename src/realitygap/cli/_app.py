"""The Typer application."""

from __future__ import annotations

import difflib
import functools
import itertools
import math
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from realitygap._caller import COMMAND, called_by
from realitygap._foreign_text import printable
from realitygap._terminal import echo
from realitygap._version import __version__
from realitygap.kernels.compile.progress import report_compiling

from ._commands import COMMANDS, Command, root_help

_STUDY_SETTINGS = (
    *("--noise", "--selection", "--arena", "--start", "--task", "--fitness"),
    *("--population", "--generations", "--steps"),
)
"""Settings that newcomers try as options of `run`."""


class _RootGroup(TyperGroup):
    """The root command. It lists all commands even if only one is loaded, and usage errors state the given value."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        formatter.write(root_help(formatter.width + 2))

    def invoke(self, ctx: Any) -> Any:
        try:
            with called_by(COMMAND):
                return super().invoke(ctx)
        except typer.BadParameter as error:
            if hasattr(error, "param_type") and error.ctx is not None:  # something is missing
                error.message = _example_of(error.ctx.command)
            from pydantic import ValidationError  # here, because its import takes long

            if isinstance(error.__cause__, ValidationError):
                from realitygap.settings import explained

                error.message = explained(error.__cause__.errors()[0])
            _make_printable(error)
            raise
        except Exception as error:
            _drop_far_suggestions(error)
            _refer_to_the_study_file(error)
            _make_printable(error)
            raise


def _drop_far_suggestions(error: Any) -> None:
    """Keep only similar options among suggestions. Typer compares the dashes, too, by which all options are alike."""
    if getattr(error, "possibilities", None) and getattr(error, "option_name", None):
        near = difflib.get_close_matches(
            error.option_name.lstrip("-"), [name.lstrip("-") for name in error.possibilities]
        )
        error.possibilities = [name for name in error.possibilities if name.lstrip("-") in near] or None


def _refer_to_the_study_file(error: Any) -> None:
    """Explain where a setting given as an option of `run` belongs. Typer exports no class for unknown options."""
    if getattr(error, "option_name", None) in _STUDY_SETTINGS and error.ctx.command.name == "run":
        error.possibilities = None
        error.message = (
            f"No such option: {error.option_name}. It is a setting of the study file. Copy one and change it: "
            "realitygap new-study my-study.toml --from paper"
        )


def _make_printable(error: Any) -> None:
    """Let no argument control the terminal; a shell may have completed it from the names of files."""
    if hasattr(error, "format_message"):
        error.message = printable(str(error.message))


def _example_of(command: Any) -> str:
    """Return the first example in the help of a command, as a sentence; empty if it has none."""
    paragraphs = (" ".join(part.split()) for part in (command.help or "").split("\n\n"))
    found = next((part for part in paragraphs if part.startswith("Example: ")), "")
    return found.replace("Example:", "For example:")


class _GroupedCommand(TyperCommand):
    """A command that refuses empty names of files, infinite numbers, and two values of an option that takes one.

    Its help lists the options of each mode together.

    Options of a mode have the same `rich_help_panel`.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words of a command; the path of an empty name would be the current folder."""
        paths = {
            option
            for parameter in self.get_params(ctx)
            if (parameter.metavar or "").startswith(("DIR", "FILE", "PATH"))
            for option in parameter.opts
        }
        for word, value in itertools.zip_longest(args, args[1:]):
            option = word.removesuffix("=")
            if option in paths and (word != option or value == ""):
                raise typer.BadParameter(
                    f"{option} is empty. Name a file or folder, or leave {option} out.", ctx
                )
        self._refuse_second_values(ctx, args)
        rest = super().parse_args(ctx, args)
        for parameter in self.get_params(ctx):
            value = ctx.params.get(parameter.name or "")
            for number in value if isinstance(value, list | tuple) else (value,):
                if isinstance(number, float) and not math.isfinite(number):
                    name = parameter.opts[0] if parameter.opts[0].startswith("-") else parameter.metavar
                    raise typer.BadParameter(f"{name} is {number}, expected a finite number.", ctx)
        return rest

    def _refuse_second_values(self, ctx: Any, args: list[str]) -> None:
        """Raise an error if an option that takes one value has two. Typer takes the last one, and says nothing."""
        if ctx.resilient_parsing:  # a shell asks for completions
            return
        order: list[Any] = self.make_parser(ctx).parse_args(args=list(args))[2]
        for parameter in order:
            is_option = parameter.param_type_name == "option"
            takes_one = is_option and not (parameter.multiple or parameter.is_flag or parameter.count)
            if takes_one and order.count(parameter) > 1:
                raise typer.BadParameter(
                    f"{parameter.opts[0]} is given {order.count(parameter)} times, expected one value. Leave out all "
                    "but one.",
                    ctx,
                )

    def format_options(self, ctx: Any, formatter: Any) -> None:
        groups: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        for parameter in self.get_params(ctx):
            title = getattr(parameter, "rich_help_panel", None) or (
                "Arguments" if parameter.param_type_name == "argument" else "Options"
            )
            if (record := parameter.get_help_record(ctx)) is not None:
                groups.setdefault(title, []).append(record)
        for title, records in groups.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)


def make_app(commands: Sequence[Command]) -> typer.Typer:
    """Return an application of these commands; their modules are imported now."""
    app = _empty_app()
    for command in commands:
        item = getattr(import_module(f"{__package__}.{command.module}"), command.attribute)
        if isinstance(item, typer.Typer):
            for each in item.registered_commands:
                each.cls = _GroupedCommand
            app.add_typer(item, name=command.name)
        else:
            settings = {"ignore_unknown_options": True} if command.passes_options_on else None
            app.command(command.name, cls=_GroupedCommand, context_settings=settings)(item)
    return app


def _empty_app() -> typer.Typer:
    app = typer.Typer(
        name="realitygap",
        cls=_RootGroup,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
        rich_markup_mode=None,
    )
    app.callback()(_root)
    return app


def app_for(arguments: Sequence[str]) -> typer.Typer:
    """Return an application with the command that the arguments name, or with all if they name none."""
    name = next((argument for argument in arguments if not argument.startswith("-")), None)
    return make_app([command for command in COMMANDS if command.name == name] or COMMANDS)


def app_to_complete(words: Sequence[str]) -> typer.Typer:
    """Return an application that a shell can ask for completions of these words.

    If they name no command yet, the application has only the names of commands: importing all of them takes a second.
    """
    if any(command.name in words for command in COMMANDS):
        return app_for(words)
    app = _empty_app()
    for command in COMMANDS:
        app.command(command.name, help=command.summary)(lambda: None)
    return app


def _version(wanted: bool) -> None:
    if wanted:
        echo(f"realitygap {__version__}")
        raise typer.Exit


def _root(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    if sys.stderr is not None and sys.stderr.isatty():
        report_compiling(functools.partial(echo, err=True))
