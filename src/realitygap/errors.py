"""The exceptions that a careful caller may catch; a bad argument is a plain `ValueError` or `TypeError`."""

from __future__ import annotations

import difflib
import math
import operator
import reprlib
from collections.abc import Iterable, Mapping
from importlib import import_module
from importlib.util import find_spec
from numbers import Real
from typing import TYPE_CHECKING, Any

from ._caller import as_given

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


class RealityGapError(Exception):
    """An error in a file, a study, or a machine, with a message for people. The base of all other errors here."""

    def __init__(self, *args: object) -> None:
        super().__init__(*(as_given(each) if isinstance(each, str) else each for each in args))


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
    """A table of results for `realitygap audit-results`, or of scores for `compare`, cannot be used as written."""


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


class RobotWarning(UserWarning):
    """A robot has not answered for some time, and its motors may be running. The driver tries to reach it again."""


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
    folded = {choice.casefold(): choice for choice in choices}
    word = name.casefold()
    near = difflib.get_close_matches(word, folded, n=1) or [
        each for each in folded if each.startswith(word[:3])
    ]
    if near and word:
        return f"Did you mean {folded[near[0]]!r}?"
    return f"Known: {', '.join(choices)}." if choices else ""


def meant(came: object, known: Iterable[str]) -> str:
    """Return a hint after a space that names the known word nearest to a value; empty if none is near."""
    near = did_you_mean(came, known) if isinstance(came, str) else ""
    return f" {near}" if near.startswith("Did") else ""


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


def real_number(name: str, value: object, least: float | None = None, most: float | None = None) -> float:
    """Return a finite real number as Python's own float; numpy's numbers are accepted too.

    Args:
        name: Name of the argument, for the message.
        value: Value of the argument.
        least, most: Smallest and largest allowed value. `most` counts only if `least` is given.

    Raises:
        TypeError: The value is not a number.
        ValueError: The value is out of range, infinite, or NaN.
    """
    expected = "a finite number"
    if least is not None:
        expected = f"at least {least}" if most is None else f"{least} to {most}"
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError(f"{name} is {value!r}, expected a number{'' if least is None else f', {expected}'}.")
    number = float(value) if _is_finite(value) else math.nan
    is_within = least is None or (least <= number and (most is None or number <= most))
    if math.isnan(number) or not is_within:
        raise ValueError(f"{name} is {value}, expected {expected}.")
    return number


def _is_finite(number: Real) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:  # an integer beyond all floats
        return False


def check_finite(values: Mapping[str, object]) -> None:
    """Raise an error if a number among some values, or in tuples and lists of them, is infinite or NaN.

    Args:
        values: Values of any kind, by name.

    Raises:
        ValueError: The message names the first such number.
    """
    for name, value in values.items():
        if isinstance(value, tuple | list):
            for index, part in enumerate(value):
                if isinstance(part, tuple | list) or (isinstance(part, Real) and not _is_finite(part)):
                    check_finite({f"{name}[{index}]": part})
        elif isinstance(value, Real) and not _is_finite(value):
            raise ValueError(f"{name} is {value}, expected a finite number.")


def finite_numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return numbers of any shape as an array, after a check that each is finite.

    Args:
        name: Name of the argument, for the message.
        values: Value of the argument.

    Raises:
        TypeError: They are not numbers.
        ValueError: One is infinite or NaN; the message names the first.
    """
    import numpy as np  # here, because every command imports this module

    try:
        given = np.asarray(values)
        if given.dtype.kind not in "biufO":  # of an object, such as a Fraction, its number is taken
            raise TypeError
        numbers = np.asarray(given, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} is {reprlib.repr(values)}, expected real numbers.") from None
    is_finite = np.isfinite(numbers)
    if not is_finite.all():
        index = np.argwhere(~is_finite)[0].tolist()
        where = f"[{', '.join(map(str, index))}]" if index else ""
        raise ValueError(f"{name}{where} is {numbers[tuple(index)]}, expected a finite number.")
    return numbers


def check_told_once(asked: int | None, generation: int) -> None:
    """Raise an error if `tell` is called twice after one `ask`: the second fitness belongs to no genome.

    Args:
        asked: Generation for which `ask` was last called; None if it never was.
        generation: Present generation.

    Raises:
        RuntimeError: They differ.
    """
    if asked is not None and asked != generation:
        raise RuntimeError(
            f"Generation {asked} has its fitness already, and nothing asked for generation {generation}. Call ask(), "
            "and tell the fitness of these genomes."
        )
