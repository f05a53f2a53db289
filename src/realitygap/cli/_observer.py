"""The observers of a robot that commands drive: a person at a terminal, who picks cells, and a camera above it."""

from __future__ import annotations

import contextlib
import math
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo, prompt
from realitygap.errors import StudyError
from realitygap.orders import ONLY_ROBOTS

from ._grid_editor import pick_cells
from ._keys import ask_verdict
from ._progress import TrialsBar, resumable

if TYPE_CHECKING:
    from realitygap.orders import EstimateOrder, GapOrder
    from realitygap.records import Observe
    from realitygap.study import Study
    from realitygap.trials import Operator, PortObserver, SheetObserver, TrialPlan, Verdict
    from realitygap.vision import Marks
    from realitygap.world import Arena

_HELP = (
    'Overhead camera by number, with options of realitygap track: "0?tag=10&tag-height=0.1&lens=cam.toml". '
    "own: poses that the robot tells, as on ROS 2."
)

Camera = Annotated[str | None, typer.Option(metavar="CAMERA", help=_HELP)]
CameraOfRobots = Annotated[
    str | None, typer.Option(metavar="CAMERA", help=_HELP, rich_help_panel=ONLY_ROBOTS)
]


def needs_operator(spec: str, witness: str | None) -> bool:
    """Return whether a person has to place the robot of a platform.

    Raises:
        StudyError: There is no such platform.
    """
    return witness is None and realitygap.platforms.platform_of(spec).needs_person


def attending_observer(spec: str, witness: str | None) -> PortObserver | None:
    """Return the person at the terminal, if there is one and the robot has no witness.

    Raises:
        StudyError: There is no such platform.
    """
    is_attended = needs_operator(spec, witness) and sys.stdin.isatty()
    return sheet_observer(asks_for_start=True) if is_attended else None


def sheet_observer(*, asks_for_start: bool) -> SheetObserver:
    """Return a person at the terminal as observer.

    Args:
        asks_for_start: Whether to ask for the robot at the start of each trial; else that was asked before.
    """
    ask = _ask_for_start if asks_for_start else None
    return realitygap.trials.SheetObserver(pick_cells, realitygap.records.NO_LINE, ask, _settle)


def _settle(problem: str, can_count: bool) -> Verdict:
    """Ask about a trial that was running when the program ended."""
    if not can_count:
        prompt(f"{problem} Enter", default="", show_default=False, err=True)
        return "void"
    words = f"{problem} v: void, drive it again; d: driven, count it"
    return ask_verdict(lambda: prompt(words, err=True))


def _ask_for_start(plan: TrialPlan, arena: Arena, observe: Observe) -> None:
    """Ask for the robot at the start of a trial, and wait."""
    sheet = ", with a fresh sheet below" if observe in ("cells", "encoders") else ""
    start = plan.start or arena.start
    inch = realitygap.world.INCH
    x, y, heading = start.x / inch, start.y / inch, math.degrees(start.heading)
    prompt(
        f"Put the robot {x:.1f} in from the left and {y:.1f} in from the lower wall, its front {heading:.0f} "
        f"degrees counter-clockwise from the long wall{sheet}. Enter",
        default="",
        show_default=False,
        err=True,
    )


@contextlib.contextmanager
def under_camera(
    spec: str | None,
    target: str,
    arena: Arena,
    observer: PortObserver | None,
    witness: str | None = None,
) -> Iterator[PortObserver | None]:
    """Return the observer of a robot, with a camera if one is named.

    Args:
        spec: Camera, as given by the user; None for none.
        target: The robot, as the user named it.
        arena: Arena of the robot.
        observer: Observer without a camera; None if no person has to place the robot.
        witness: Witness of an emulated robot, which then places it, and does not report its poses.

    Raises:
        StudyError: The camera's options are wrong, or the robot has no operator.
        VisionError: There is no such camera.
    """
    if spec is None:
        yield observer
        return
    if spec == realitygap.study.OWN_POSES:
        if not realitygap.platforms.class_of(target).is_physical:
            raise StudyError(
                f"--camera own is for a robot that tells its poses. Leave it out: {target} reports them anyway."
            )
        yield realitygap.study.OwnPosesObserver(arena, observer or _witness_of(witness))
        return
    if observer is None:
        raise StudyError(
            "--camera is only for a robot that an operator places at its start. Simulators, twins, and "
            "emulators report their poses."
        )

    number, marks = parse_camera(spec, arena)
    with realitygap.vision.LiveTrack(realitygap.vision.CameraDevice(number), marks) as live:
        yield realitygap.study.CameraObserver(live, arena, observer)


def _witness_of(address: str | None) -> PortObserver:
    remote = None if address is None else realitygap.emulator.connect_witness(address)
    return realitygap.trials.WitnessObserver(remote)


@contextlib.contextmanager
def measuring(
    order: GapOrder | EstimateOrder, camera: str | None, *, quiet: bool
) -> Iterator[dict[str, Any]]:
    """Return the observer of the target, and what shows progress; end at Ctrl-C as `resumable`.

    Raises:
        StudyError: The camera's options are wrong, or the robot has no operator.
        VisionError: There is no such camera.
    """
    arena = realitygap.world.load_arena(order.arena or "paper")
    observer = attending_observer(order.target, order.witness)
    how = "" if order.results else "To save trials, add -o FILE."
    with (
        resumable(order.results, how),
        TrialsBar(quiet=quiet) as bar,
        under_camera(camera, order.target, arena, observer, order.witness) as seen_by,
    ):
        yield {"observer": seen_by, "tell": bar.show, "say": bar.say}


@contextlib.contextmanager
def operated_under_camera(spec: str | None, study: Study, operator: Operator) -> Iterator[Operator]:
    """Return the operator of a physical study, with a camera if one is named.

    Args:
        spec: Camera, as given by the user; None for none.
        study: Study whose first physical condition gives the arena.
        operator: Observer without a camera.

    Raises:
        StudyError: The camera's options cannot be, or the robot is an emulated one.
        VisionError: There is no such camera.
    """
    if spec is None:
        yield operator
        return
    if operator.observer is not None:
        raise StudyError(
            "--camera is only for a robot on the floor. Leave it out: an emulator's witness observes its path."
        )

    arena = realitygap.study.physical_conditions(study)[0].arena.arena()
    if spec == realitygap.study.OWN_POSES:
        operator.observer = realitygap.study.OwnPosesObserver(arena, say=lambda text: echo(text, err=True))
        yield operator
        return
    number, marks = parse_camera(spec, arena)
    with realitygap.vision.LiveTrack(realitygap.vision.CameraDevice(number), marks) as live:
        operator.observer = realitygap.study.CameraObserver(
            live, arena, say=lambda text: echo(text, err=True)
        )
        yield operator


def parse_camera(spec: str, arena: Arena) -> tuple[int, Marks]:
    """Return the number of a camera, and what it looks for.

    Raises:
        StudyError: Something in it cannot be.
    """
    number, marks = realitygap.study.read_camera(spec, arena)
    if not number.isdecimal():
        raise StudyError(
            f"--camera is {spec!r}, expected a camera's number such as 0, or 0?tag=10&tag-height=0.1."
        )
    return int(number), marks
