"""A camera above a robot, as one text says it: which one, and what to look for."""

from __future__ import annotations

import math
from pathlib import Path
from urllib.parse import parse_qsl

from realitygap.errors import StudyError, did_you_mean
from realitygap.vision import CORNER_SIZE_M, FAMILIES, Marks, RobotTag, read_lens
from realitygap.world import Arena

_KEYS = ("tag", "tag-size", "tag-height", "tag-at", "corner-size", "corner-inset", "lens")


def read_camera(spec: str, arena: Arena) -> tuple[str, Marks]:
    """Return a camera's number or a video's file, and what to look for in its pictures.

    Args:
        spec: Camera, such as 0, or film.mp4?tag=10&tag-height=0.1. The options of `realitygap track` follow the
            question mark.
        arena: Arena of the robot.

    Raises:
        StudyError: Something in it cannot be.
        VisionError: The lens cannot be read.
    """
    name, _, query = spec.partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    unknown = [key for key in options if key not in _KEYS]
    if unknown:
        raise StudyError(f"--camera: unknown option {unknown[0]!r}. {did_you_mean(unknown[0], _KEYS)}")

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
    return name, marks_of(
        arena, tag, None if lens is None else Path(lens), length("corner-size"), length("corner-inset")
    )


def tag_of(text: str, size: float, height: float, at: str) -> RobotTag:
    """Return the robot's tag by options: number or FAMILY:NUMBER, side [m], height [m], and AHEAD,LEFT,DEGREES.

    Raises:
        StudyError: One of them cannot be.
    """
    family, colon, number = text.rpartition(":")
    if not number.isdecimal() or (colon and family not in FAMILIES):
        raise StudyError(
            f"tag is {text!r}, expected a number such as 10, or FAMILY:NUMBER. {did_you_mean(family, FAMILIES)}"
        )
    try:
        ahead, left, degrees = (float(part) for part in at.split(","))
    except ValueError:
        raise StudyError(f"tag-at is {at!r}, expected three numbers such as 0.02,0,90.") from None
    try:
        return RobotTag(int(number), size, height, family, ahead, left, math.radians(degrees))
    except ValueError as error:
        raise StudyError(f"The robot's tag: {error}") from None


def marks_of(
    arena: Arena, tag: RobotTag, lens: Path | None, corner_size: float | None, corner_inset: float | None
) -> Marks:
    """Return the marks that are known before a camera records, by options.

    Raises:
        VisionError: The lens cannot be read.
    """
    known = None if lens is None else read_lens(lens)
    return Marks(arena, tag, known, CORNER_SIZE_M if corner_size is None else corner_size, corner_inset)
