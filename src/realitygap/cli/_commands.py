"""The list of commands. `realitygap --help` prints it without loading Typer or any command."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

from realitygap._how_to_run import launcher

NARROWEST = 50
WIDEST = 80
PURPOSE = (
    "Evolve robot controllers in simulation, run them on a real robot, and measure and close the gap between "
    "the two."
)

OPTIONS = {
    "--version": "Print the version.",
    "--install-completion": "Install completion for the current shell.",
    "--show-completion": "Print the completion script of the current shell.",
    "-h, --help": "Show this message and exit.",
}


@dataclass(frozen=True)
class Command:
    """A command or a group of commands.

    Attributes:
        name: The word on the command line.
        summary: Line for the list; for a command, the first line of its docstring.
        module: The module of `realitygap.cli` that defines it.
        attribute: The function or the Typer group in that module.
        passes_options_on: True if it takes the options of another command.
    """

    name: str
    summary: str
    module: str
    attribute: str
    passes_options_on: bool = False


START = "Start here"

SECTIONS: dict[str, tuple[Command, ...]] = {
    START: (
        Command("demo", "Take a two-minute tour with an emulated robot.", "_demo", "demo"),
        Command("run", "Run a study, or resume one that was interrupted.", "_study", "run"),
        Command("gap", "Measure the gap between a simulator and a target.", "_gap", "gap"),
        Command("close", "Measure the gap, calibrate, measure it again.", "_gap", "close"),
        Command("lab", "Serve the web interface for studies, robots, and trials.", "_lab", "lab"),
    ),
    "Studies and their results": (
        Command("new-study", "Write a study file to change: a template, or a copy.", "_study", "new_study"),
        Command("drive", "Drive the conditions of a study that are on a robot.", "_drive", "drive"),
        Command("report", "Write the HTML report of a study.", "_results", "report"),
        Command("show", "Draw a run, trial, network, arena, or robot.", "_show", "show"),
        Command("export", "Export a network as JSON, ONNX, C, Aseba, or a graph.", "_export", "export"),
    ),
    "The gap": (
        Command("compare", "Measure the gap in a table of scores.", "_compare", "compare"),
        Command("plan", "Estimate how many controllers and trials you need.", "_gap", "plan"),
        Command(
            "estimate", "Estimate a robot's mean score, assisted by simulation.", "_estimate", "estimate"
        ),
        Command("calibrate", "Fit the simulator to a robot.", "_calibrate", "calibrate"),
        Command("transfer", "Compare strategies that transfer controllers.", "_transfer", "transfer"),
        Command("try", "Drive one exported controller on any platform.", "_transfer", "try_genome"),
        Command("again", "Repeat a measurement from its result.", "_order", "again", True),
        Command("import", "Turn a log of a real robot into trials.", "_import", "import_log"),
        Command("twin", "Sample and inspect MuJoCo twins (pseudo-reality).", "_twin", "twin"),
    ),
    "Robots": (
        Command("robot", "Connect to a robot and send it commands.", "_robot", "robot"),
        Command("emulate", "Emulate a robot on a pseudo-terminal or TCP port.", "_emulate", "emulate"),
        Command("platforms", "List the platforms that can run trials.", "_platforms", "platforms"),
        Command("arena", "Convert an arena from or to a map of ROS.", "_arena", "arena"),
    ),
    "Trials of a robot": (
        Command("trials", "List, show, score, annotate, and export trials.", "_trials", "trials"),
        Command(
            "print-sheet",
            "Write the paper sheet of an arena (PDF, true scale).",
            "_print_sheet",
            "print_sheet",
        ),
        Command("print-tags", "Write the tags for the camera (PDF, true scale).", "_track", "print_tags"),
        Command("score", "Read the crossed cells from a photo of a sheet.", "_score", "score"),
        Command("track", "Track a tagged robot in a video or camera stream.", "_track", "track"),
        Command(
            "export-trials",
            "Write driven trials as JSON, Parquet, MCAP, or bags.",
            "_export",
            "export_trials",
        ),
    ),
    "Advanced": (
        Command("simulate", "Run one case file as the Jyro simulator does.", "_platforms", "simulate"),
        Command("audit-results", "Report what a small table of results can show.", "_audit", "audit_results"),
        Command("audit-distance", "Report what a behavior distance weighs.", "_audit", "audit_distance"),
        Command("bench", "Measure the speed of this machine.", "_bench", "bench"),
        Command("digest", "Print the hash of a study's results.", "_results", "digest"),
        Command("lens", "Calibrate a camera lens from a checkerboard video.", "_track", "lens"),
    ),
}
COMMANDS = tuple(command for commands in SECTIONS.values() for command in commands)


def _entry(start: str, text: str, width: int) -> list[str]:
    return textwrap.wrap(
        text, width, initial_indent=start, subsequent_indent=" " * len(start), break_on_hyphens=False
    )


def root_help(columns: int) -> str:
    """Return the text of `realitygap --help` for a terminal of that many columns."""
    width = max(NARROWEST, min(columns, WIDEST) - 2)
    lines = ["Usage: realitygap [OPTIONS] COMMAND [ARGS]...", ""]
    lines += textwrap.wrap(PURPOSE, width, initial_indent="  ", subsequent_indent="  ")
    for title, commands in SECTIONS.items():
        lines += ["", f"{title}:"]
        for command in commands:
            lines += _entry(f"  {command.name:<15} ", command.summary, width)
        if title == START:
            advice = f"`{launcher()} demo --open` is a good start. `realitygap COMMAND --help` has examples."
            lines += ["", *_entry("  ", advice, width)]
    lines += ["", "Options:"]
    for option, meaning in OPTIONS.items():
        lines += _entry(f"  {option:<20}  ", meaning, width)
    return "\n".join(lines) + "\n"
