"""A camera above a robot, as an option of commands that drive one."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl

import typer

from realitygap.errors import StudyError, did_you_mean

if TYPE_CHECKING:
    from realitygap.study import Study
    from realitygap.trials import Attendant, Operator
    from realitygap.vision import Marks
    from realitygap.world import Arena

CAMERA_HELP = (
    'Above the robot: its number, with options of realitygap track: "0?tag=10&tag-height=0.1&lens=cam.toml".'
)
_KEYS = ("tag", "tag-size", "tag-height", "tag-at", "corner-size", "corner-inset", "lens")


@contextlib.contextmanager
def under_camera(spec: str | None, arena: Arena, attendant: Attendant | None) -> Iterator[Attendant | None]:
    """Who stands beside a robot, with a camera where one is named.

    Args:
        spec: Of the camera; None where there is none.
        arena: Where.
        attendant: Who puts the robot at its start; None where nobody has to.

    Raises:
        StudyError: The camera's options cannot be, or nobody stands beside the robot.
        VisionError: There is no such camera.
    """
    if spec is None:
        yield attendant
        return
    if attendant is None:
        raise StudyError(
            "--camera goes with a robot that somebody at a terminal puts at its start: simulators, twins and emulators "
            "tell where they are."
        )
    from realitygap.study import CameraAttendant
    from realitygap.vision import CameraDevice, LiveTrack

    number, marks = parse_camera(spec, arena)
    with LiveTrack(CameraDevice(number), marks) as live:
        yield CameraAttendant(attendant, live)


@contextlib.contextmanager
def operated_under_camera(spec: str | None, study: Study, operator: Operator) -> Iterator[Operator]:
    """The operator of a physical study, with a camera where one is named.

    Args:
        spec: Of the camera; None where there is none.
        study: Whose first physical condition says in which arena.
        operator: Without a camera.

    Raises:
        StudyError: The camera's options cannot be, or the robot is an emulated one.
        VisionError: There is no such camera.
    """
    if spec is None:
        yield operator
        return
    from realitygap.trials import WitnessOperator

    if isinstance(operator, WitnessOperator):
        raise StudyError(
            "--camera goes with a robot on the floor: an emulator's witness sees where it drives."
        )
    from realitygap.study import CameraOperator, physical_conditions
    from realitygap.vision import CameraDevice, LiveTrack

    arena = physical_conditions(study)[0].arena.arena()
    number, marks = parse_camera(spec, arena)
    with LiveTrack(CameraDevice(number), marks) as live:
        yield CameraOperator(operator, live, arena.grid, lambda text: typer.echo(text, err=True))


def parse_camera(spec: str, arena: Arena) -> tuple[int, Marks]:
    """Number of a camera, and what it looks for.

    Raises:
        StudyError: Something in it cannot be.
    """
    from ._track import marks_of, tag_of

    number, _, query = spec.partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    unknown = [key for key in options if key not in _KEYS]
    if unknown:
        raise StudyError(f"--camera: unknown option {unknown[0]!r}. {did_you_mean(unknown[0], _KEYS)}")
    if not number.isdecimal():
        raise StudyError(
            f"--camera is {spec!r}, expected a camera's number such as 0, or 0?tag=10&tag-height=0.1."
        )

    def length(name: str) -> float | None:
        text = options.get(name)
        try:
            return None if text is None else float(text)
        except ValueError:
            raise StudyError(f"--camera: {name} is {text!r}, expected a length in meters.") from None

    size, height = length("tag-size"), length("tag-height")
    tag = tag_of(
        options.get("tag", "10"),
        0.07 if size is None else size,
        0.1 if height is None else height,
        options.get("tag-at", "0,0,0"),
    )
    lens = options.get("lens")
    return int(number), marks_of(
        arena, tag, None if lens is None else Path(lens), length("corner-size"), length("corner-inset")
    )
