"""A camera above a robot, as an option of commands that drive one."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import StudyError
from realitygap.orders import ONLY_ROBOTS

if TYPE_CHECKING:
    from realitygap.study import Study
    from realitygap.trials import Operator, PortObserver
    from realitygap.vision import Marks
    from realitygap.world import Arena

_HELP = (
    'Overhead camera by number, with options of realitygap track: "0?tag=10&tag-height=0.1&lens=cam.toml".'
)

Camera = Annotated[str | None, typer.Option(metavar="CAMERA", help=_HELP)]
CameraOfRobots = Annotated[
    str | None, typer.Option(metavar="CAMERA", help=_HELP, rich_help_panel=ONLY_ROBOTS)
]


@contextlib.contextmanager
def under_camera(
    spec: str | None, arena: Arena, observer: PortObserver | None
) -> Iterator[PortObserver | None]:
    """Return the observer of a robot, with a camera if one is named.

    Args:
        spec: Camera, as given by the user; None for none.
        arena: Arena of the robot.
        observer: Observer without a camera; None if no person has to place the robot.

    Raises:
        StudyError: The camera's options are wrong, or the robot has no operator.
        VisionError: There is no such camera.
    """
    if spec is None:
        yield observer
        return
    if observer is None:
        raise StudyError(
            "--camera is only for a robot that an operator places at its start. Simulators, twins, and "
            "emulators report their poses."
        )

    number, marks = parse_camera(spec, arena)
    with realitygap.vision.LiveTrack(realitygap.vision.CameraDevice(number), marks) as live:
        yield realitygap.study.CameraObserver(live, arena, observer)


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
