"""`realitygap demo`: a tour of the main commands."""

from __future__ import annotations

import shlex
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from realitygap._how_to_run import launcher
from realitygap._terminal import echo
from realitygap.errors import StudyError
from realitygap.robot_families import default_family

from ._app import app_for
from ._results import show_page

_FAMILY = default_family()
_ROBOT = f"{_FAMILY.named(_FAMILY.emulated)}&speed=off"
_WORN = f'base = "{_FAMILY.robot}"\n\n[drive]\ngain_left = 0.7\ngain_right = 0.75\n'
"""File of a robot with worn motors."""

_MEASURED = ("--n-controllers", "10", "--trials", "3", "--observe", "track")
_CALIBRATED = ("--what", "path", "--budget", "10", "--n-controllers", "20", "--trials", "5")


def demo(
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the results. [default: a new temporary folder]"),
    ] = None,
    open_page: Annotated[
        bool,
        typer.Option(
            "--open", help="When done, show the reports of the study and of the closed gap in the browser."
        ),
    ] = False,
) -> None:
    """Take a two-minute tour with an emulated robot.

    The tour runs a small study, writes its report, drives a controller on an emulated robot, and measures the gap
    between a simulator and that robot. It closes the gap to a simulated robot with worn motors. It prints each command
    before it runs it. Ctrl-C ends the tour.

    Example: realitygap demo --open

    Example: realitygap demo --out my-tour

    In Python: realitygap.run_study("paper", "my-tour/paper", replicates=20)
    """
    folder = _made(out)
    steps = _steps(folder)
    echo(f"The results go to {folder}.")
    try:
        for number, (purpose, commands) in enumerate(steps, 1):
            echo(f"\nStep {number} of {len(steps)}: {purpose}")
            for words in commands:
                echo(f"$ realitygap {shlex.join(words)}")
                _run(words)
    except KeyboardInterrupt:
        echo(f"Interrupted. The results of the finished commands are in {folder}.", err=True)
        raise typer.Exit(130) from None
    echo(
        f"\nThe results of this tour are in {folder}:\n"
        "  paper/report.html   report of the study: figures, tables, and trials to play\n"
        "  champion.gif        film of the controller in simulation\n"
        "  gap.html            the gap: one controller in motion in both worlds, and all scores\n"
        "  closed/report.html  the same before and after the calibration to a robot with worn motors\n"
        f"Next, change the paper's study: {launcher()} new-study my-study.toml --from paper"
    )
    if open_page:
        show_page(folder / "paper" / "report.html")
        show_page(folder / "closed" / "report.html")


def _made(folder: Path | None) -> Path:
    """Make the folder for the results and return it.

    Raises:
        StudyError: The name belongs to a file.
    """
    if folder is None:
        return Path(tempfile.mkdtemp(prefix="realitygap-demo-"))
    if folder.exists() and not folder.is_dir():
        raise StudyError(f"--out is the file {folder}, expected a folder. Name another one.")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _steps(folder: Path) -> list[tuple[str, list[list[str]]]]:
    """Return the purpose of each step of the tour, and the words of its commands."""
    names = ("paper", "champion.json", "champion.gif", "gap.html", "worn.toml", "closed")
    study, champion, film, gap, worn, closed = (str(folder / name) for name in names)
    Path(worn).write_text(_WORN, "utf-8")
    return [
        (
            "Evolve controllers in simulation. The paper's study has 9 conditions, here with 20 runs each.",
            [["run", "paper", "--replicates", "20", "--out", study]],
        ),
        ("Write the report of the study.", [["report", study]]),
        (
            "Save the best controller of a novelty search, film it, and drive it on an emulated robot.",
            [
                ["export", study, "--condition", "novelty-50", "-o", champion],
                ["show", study, "--condition", "novelty-50", "-o", film],
                ["try", champion, "--on", _ROBOT, "--trials", "3"],
            ],
        ),
        (
            "Measure the gap between a simulator and the emulated robot.",
            [["gap", "sim", _ROBOT, *_MEASURED, "--report", gap]],
        ),
        (
            "Close the gap to a simulated robot with worn motors: calibrate, and measure again.",
            [["close", "sim", f"sim:{worn}", *_CALIBRATED, "-o", closed]],
        ),
    ]


def _run(words: list[str]) -> None:
    """Run a command in this process.

    Raises:
        KeyboardInterrupt: Ctrl-C ended the command.
    """
    if app_for(words)(words, prog_name="realitygap", standalone_mode=False):
        raise KeyboardInterrupt
