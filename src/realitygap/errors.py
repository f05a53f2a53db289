"""The exceptions that a careful caller may catch; a bad argument is a plain `ValueError` or `TypeError`."""

from __future__ import annotations

import difflib
import operator
from collections.abc import Iterable
from importlib import import_module
from importlib.util import find_spec
from numbers import Real
from typing import Any


class RealityGapError(Exception):
    """An error in a file, a study, or a machine, with a message for people. The base of all other errors here."""


class StudyError(RealityGapError):
    """A study, or the file that describes it, cannot be run as written."""


class OutgrownError(StudyError):
    """A genome of a run grew beyond the largest supported size. No part of the run is stored."""


class TaskError(StudyError):
    """A custom function that scores trials cannot be loaded, or failed."""


class RecordError(RealityGapError):
    """A folder of results holds something that cannot be trusted or cannot be written."""


class RecordVersionError(RecordError):
    """Results were computed by a version whose numbers may differ."""


class ClusterError(RealityGapError):
    """A cluster cannot be reached, or cannot compute a request. Chunks that were published before are safe."""


class CaseError(RealityGapError):
    """A case file for `realitygap simulate` cannot be run as written."""


class ControllerError(RealityGapError, ValueError):
    """A controller does not name its inputs, or a platform does not have them."""


class DescriptionError(RealityGapError, ValueError):
    """The file of a robot or an arena cannot be used as written, or there is none of that name."""


class TableError(RealityGapError):
    """A table of results for `realitygap audit-results` cannot be read as written."""


class LogError(RealityGapError):
    """A log or a table of measurements of a robot cannot be read with its mapping."""


class RobotError(RealityGapError):
    """A robot cannot be reached, or does not obey a command. The message states whether its motors are stopped."""


class RobotTimeout(RobotError):  # noqa: N818  # the word that its users know
    """No answer came in time."""


class RobotStopped(RobotError):  # noqa: N818  # the word that its users know
    """The operator stopped the robot by a button on it."""


class ProtocolError(RobotError):
    """A received byte or message does not follow the protocol."""


class LedgerError(RecordError):
    """A ledger of physical trials cannot be trusted or written, or does not allow the requested change."""


class VisionError(RealityGapError):
    """A picture or video cannot be read, or does not show what is needed. The message names what is missing."""


class MissingExtraError(RealityGapError, ImportError):
    """Something needs packages that come with an extra of realitygap, which is not installed."""


def from_extra(module: str, extra: str) -> Any:
    """Return a module that comes with an extra of realitygap.

    Raises:
        MissingExtraError: The module is not installed; the message has the command that installs it.
        KeyboardInterrupt: The user pressed Ctrl-C while the module was loading. Some modules written in C report that
            as an ImportError.
    """
    try:
        return import_module(module)
    except ImportError as error:
        if isinstance(error.__cause__ or error.__context__, KeyboardInterrupt):
            raise KeyboardInterrupt from error
        raise _missing(module, extra, f"cannot be imported ({error})") from error


def require_extra(module: str, extra: str) -> None:
    """Raise an error before work starts for which another process needs an extra that is not installed.

    Raises:
        MissingExtraError: The module is not installed; the message has the command that installs it.
    """
    if find_spec(module) is None:
        raise _missing(module, extra, "is not installed")


def _missing(module: str, extra: str, problem: str) -> MissingExtraError:
    from realitygap._how_to_run import install_command  # here, because every command imports this module

    return MissingExtraError(
        f"This needs {module.partition('.')[0]}, which comes with the extra '{extra}' and {problem}. Install it: "
        f"{install_command(extra)}"
    )


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a hint that names the known word nearest to `name`, or lists all; empty if there are none."""
    choices = sorted(known)
    near = difflib.get_close_matches(name, choices, n=1, cutoff=0.5)
    if near:
        return f"Did you mean {near[0]!r}?"
    return f"Known: {', '.join(choices)}." if choices else ""


def whole_number(name: str, value: object, least: int | None = None, most: int | None = None) -> int:
    """Return a whole number as Python's own int; numpy's whole numbers are accepted too.

    Args:
        name: Name of the argument, for the message.
        value: Value of the argument.
        least, most: Smallest and largest allowed value. `most` counts only if `least` is given.

    Raises:
        TypeError: The value is not a whole number.
        ValueError: The value is out of range.
    """
    try:
        number = operator.index(value)  # type: ignore[arg-type]  # refused below where it has no such thing
    except TypeError:
        number = None
    if number is None or isinstance(value, bool):
        raise TypeError(f"{name} is {value!r}, expected a whole number.")
    if least is not None and (number < least or (most is not None and number > most)):
        expected = f"at least {least}" if most is None else f"{least} to {most}"
        raise ValueError(f"{name} is {number}, expected {expected}.")
    return number


def real_number(name: str, value: object, least: float, most: float) -> float:
    """Return a real number as Python's own float; numpy's numbers are accepted too.

    Args:
        name: Name of the argument, for the message.
        value: Value of the argument.
        least, most: Smallest and largest allowed value.

    Raises:
        TypeError: The value is not a number.
        ValueError: The value is out of range, or NaN.
    """
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError(f"{name} is {value!r}, expected a number from {least} to {most}.")
    number = float(value)
    if not least <= number <= most:
        raise ValueError(f"{name} is {value}, expected {least} to {most}.")
    return number
