"""A `JyroWorld` as a file: a picture, or a movie."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from realitygap.drawing import to_image, to_png
from realitygap.records import write_whole

if TYPE_CHECKING:
    from PIL.Image import Image

    from ._world import JyroWorld

_HUNDREDTH = 10  # of a second, the unit of time in a GIF [ms]


def save_world(world: JyroWorld, path: str | Path, width: int = 720) -> Path:
    """Write a picture of the world; an existing file gives way when all is written.

    Args:
        world: As it is now.
        path: Ends in .svg or .png.
        width: Of a .png [pixels].

    Raises:
        ValueError: The path ends in something else.
        RecordError: It cannot be written, or belongs to a study's results.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in (".svg", ".png"):
        raise ValueError(f"{path} ends in {ending or 'nothing'}, expected .svg or .png.")
    picture = world.picture()
    write_whole(path, [picture.to_svg().encode() if ending == ".svg" else to_png(picture, width)])
    return path


def save_world_movie(
    world: JyroWorld, path: str | Path, n_steps: int, *, every: int = 1, width: int = 480
) -> Path:
    """Go on by some steps, and write what happens as a GIF that is as fast as the simulated time.

    Args:
        world: Goes on from where it is.
        path: Ends in .gif.
        n_steps: How many steps.
        every: Steps from one picture to the next.
        width: Of the movie [pixels].

    Raises:
        ValueError: The path ends in something else, or a number is below 1.
        RecordError: It cannot be written, or belongs to a study's results.
    """
    path = Path(path)
    if path.suffix.lower() != ".gif":
        raise ValueError(f"{path} ends in {path.suffix or 'nothing'}, expected .gif.")
    if n_steps < 1 or every < 1:
        raise ValueError(f"n_steps is {n_steps} and every {every}, expected 1 or more.")
    images = [to_image(world.picture(), width)]
    for step in range(n_steps):
        world.step()
        if (step + 1) % every == 0:
            images.append(to_image(world.picture(), width))
    write_whole(path, [_gif(images, round(100 * world.step_s * every) * _HUNDREDTH)])
    return path


def _gif(images: list[Image], milliseconds: int) -> bytes:
    from PIL.Image import Dither

    file = io.BytesIO()
    first, *others = [image.quantize(dither=Dither.NONE) for image in images]
    first.save(file, "GIF", save_all=True, append_images=others, duration=max(20, milliseconds), loop=0)
    return file.getvalue()
