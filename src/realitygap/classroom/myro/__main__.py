"""`python -m realitygap.classroom.myro program.py`: run a program of a Myro course, on robots or simulated ones."""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import math
import random
import runpy
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import realitygap.classroom.myro as myro
from realitygap._foreign_text import printable
from realitygap.errors import RealityGapError

from . import _robot
from ._base import TimeUp
from ._flow import currentTime, wait
from ._mistakes import explanation
from ._ports import force_port
from ._simulation import is_simulation

_EXAMPLE = """example:
  python -m realitygap.classroom.myro dance.py --port sim
  python -m realitygap.classroom.myro dance.py --seeds 1-10 --limit 60
"""
_GIVEN = ("myro", "Myro", "graphics", "Graphics")
"""The names of modules under which programs of the courses know these functions."""

_SIGNAL = 128
"""Status above which a signal ended the program. Then no other program is run."""


def main(arguments: list[str] | None = None) -> int:
    """Run a program; returns 0 when it ended by itself, or as the limit says, on every seed."""
    options = _parser().parse_args(arguments)
    if not options.program.is_file():
        print(f"There is no program {str(options.program)!r}.", file=sys.stderr)
        return 2
    try:
        return _once(options) if options.seeds is None else _each_seed(options)
    except KeyboardInterrupt:
        print("Stopped by Ctrl-C, the program and the robot.", file=sys.stderr)
        return 130


def _each_seed(options: argparse.Namespace) -> int:
    rows = [_graded(options, seed) for seed in options.seeds]
    print(json.dumps(rows, indent=2) if options.json else _table(rows))
    return 0 if all(row["error"] is None for row in rows) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m realitygap.classroom.myro",
        description="Run a program of a Myro course as it is, whatever port it asks for.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("program", type=Path, help="a program in Python 3 that says `from myro import *`")
    parser.add_argument(
        "--port", help='the robot it gets: a port, or "sim?start=random"; as it asks for by default'
    )
    parser.add_argument(
        "--seeds", type=_seeds, help="run it on a simulated robot once for each seed, as 1-10 or 1,5,7"
    )
    parser.add_argument(
        "--limit", type=_duration, help="stop it after this number of seconds on the robot's clock"
    )
    parser.add_argument("--json", action="store_true", help="with --seeds: print the results as JSON")
    return parser


def _seeds(text: str) -> list[int]:
    try:
        ranges = [part.partition("-") for part in text.split(",")]
        seeds = [
            seed for low, dash, high in ranges for seed in range(int(low), int(high if dash else low) + 1)
        ]
    except ValueError:
        seeds = []
    if not seeds:
        raise argparse.ArgumentTypeError(f"{text!r}, expected seeds as 1-10 or 1,5,7")
    return seeds


def _duration(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 < seconds < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r}, expected seconds, more than 0")
    return seconds


def _once(options: argparse.Namespace) -> int:
    force_port(options.port)
    try:
        error = _run(options.program, options.limit)
    finally:
        force_port(None)
    _, trace_of_program = _outcome()
    if error is not None:
        print(printable(str(error)), file=sys.stderr)
    if trace_of_program:
        print(trace_of_program)
    return 0 if error is None else 1


def _graded(options: argparse.Namespace, seed: int) -> dict[str, Any]:
    port = options.port or "sim?speed=off&start=random"
    if not is_simulation(port):
        raise SystemExit(
            f"--seeds needs a simulated robot, --port is {port!r}; expected something like sim?speed=off."
        )
    force_port(f"{port}{'&' if '?' in port else '?'}seed={seed}&view=off")
    random.seed(seed)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            error = _run(options.program, options.limit)
    finally:
        force_port(None)
    result, _ = _outcome()
    return {"seed": seed, **result, "error": error}


_finished: list[Any] = []
"""The robots that a program opened, as they were at its end."""


def _run(program: Path, limit: float | None) -> str | None:
    """Run a program to its end; what went wrong, as text, or None."""
    _finished.clear()
    with _as_myro(), _on_the_robots_clock(), _limited(limit):
        try:
            runpy.run_path(str(program), run_name="__main__")
        except TimeUp:
            return None
        except SystemExit as end:
            return _said_at_exit(end)
        except RealityGapError as error:
            return explanation(error, error.__traceback__)
        except Exception as error:
            return explanation(error, error.__traceback__)
        finally:
            _end()
    return None


def _said_at_exit(end: SystemExit) -> str | None:
    """Return the reason why a program ended itself, as text; None for a normal end."""
    if end.code is None or end.code == 0:
        return None
    if isinstance(end.code, int) and end.code > _SIGNAL:
        raise end
    return f"The program ended itself: {end.code}"


def _end() -> None:
    robot = _robot.robot_or_none()
    if robot is not None:
        _finished.append((robot.simulation, robot.clock.now()))
        robot.close()


def _outcome() -> tuple[dict[str, Any], str]:
    """Return the result of the robot's last run: as values, and as a map."""
    simulation, seconds = _finished[-1] if _finished else (None, 0.0)
    if simulation is None:
        return {"seconds": None, "cells": None, "coverage": None}, ""
    values = {
        "seconds": round(seconds, 1),
        "cells": len(simulation.cells()),
        "coverage": round(simulation.coverage(), 3),
    }
    return values, str(simulation)


@contextlib.contextmanager
def _as_myro() -> Iterator[None]:
    """Let programs import these functions under the names that they know."""
    before = {name: sys.modules.get(name) for name in _GIVEN}
    sys.modules.update(dict.fromkeys(_GIVEN, myro))
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                sys.modules.pop(name, None)
            else:
                sys.modules[name] = module


@contextlib.contextmanager
def _on_the_robots_clock() -> Iterator[None]:
    """Let `time.sleep` and `time.time` of a program be the robot's, which may run faster than the wall's."""
    sleep, now = time.sleep, time.time

    def on_clock(seconds: float) -> None:
        if _is_untimed():
            wait(seconds)
        else:
            sleep(seconds)

    time.sleep = on_clock  # type: ignore[assignment]  # takes what sleep takes
    time.time = lambda: currentTime() if _is_untimed() else now()
    try:
        yield
    finally:
        time.sleep, time.time = sleep, now


def _is_untimed() -> bool:
    robot = _robot.robot_or_none()
    return robot is not None and robot.simulation is not None and not robot.simulation.is_timed


@contextlib.contextmanager
def _limited(limit: float | None) -> Iterator[None]:
    """Limit each robot that is opened to this number of seconds."""
    _robot.set_limit(limit)
    try:
        yield
    finally:
        _robot.set_limit(None)


def _table(rows: list[dict[str, Any]]) -> str:
    lines = ["seed  seconds  cells  coverage  ended"]
    for row in rows:
        error = "" if row["error"] is None else row["error"].splitlines()[-1]
        numbers = (
            "                       "
            if row["cells"] is None
            else f"{row['seconds']:7.1f}  {row['cells']:5d}  {row['coverage']:8.0%}"
        )
        lines.append(f"{row['seed']:4d}  {numbers}  {error or 'well'}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
