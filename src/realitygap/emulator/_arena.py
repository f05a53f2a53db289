"""Arenas by name or from a file, for an emulated robot."""

from __future__ import annotations

from realitygap.errors import DescriptionError, RobotError
from realitygap.world import Arena, load_arena


def open_arena(name: str) -> Arena:
    """Return the arena of that name, or of a file.

    Args:
        name: Name of an arena, or the path of its TOML or SVG file.

    Raises:
        RobotError: There is no such arena or file, or the file cannot be used; the text says where and why.
    """
    try:
        arena = load_arena(name)
    except DescriptionError as error:
        raise RobotError(str(error)) from None
    if arena.vary:
        raise RobotError(
            f"{name}: {', '.join(arena.vary)} are drawn, expected plain numbers: an emulator draws none."
        )
    return arena
