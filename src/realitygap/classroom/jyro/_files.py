"""Pictures of a `JyroWorld` as a file."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from realitygap.drawing import Picture, to_image, to_png
from realitygap.records import write_whole

if TYPE_CHECKING:  # Pillow takes a while to import
    from PIL.Image import Image

_HUNDREDTH = 10  # of a second, the unit of time in a GIF [ms]


def save_picture(picture: Picture, path: str | Path, width: int = 720) -> Path:
    """Write a picture; an existing file is replaced when the new one is complete.

    Args:
        picture: The picture.
        path: A file that ends in .svg or .png.
        width: Width of a .png [pixels].

    Raises:
        ValueError: The path has another ending.
        RecordError: The file cannot be written, or belongs to a study's results.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in (".svg", ".png"):
        raise ValueError(f"{path} ends in {ending or 'nothing'}, expected .svg or .png.")
    write_whole(path, [picture.to_svg().encode() if ending == ".svg" else to_png(picture, width)])
    return path


def save_movie(pictures: Iterable[Picture], path: str | Path, each_s: float, width: int = 480) -> Path:
    """Write pictures as a GIF.

    Args:
        pictures: One or more pictures. They are drawn during writing.
        path: A file that ends in .gif.
        each_s: Duration of each picture [s].
        width: Width of the movie [pixels].

    Raises:
        ValueError: The path has another ending.
        RecordError: The file cannot be written, or belongs to a study's results.
    """
    path = Path(path)
    if path.suffix.lower() != ".gif":
        raise ValueError(f"{path} ends in {path.suffix or 'nothing'}, expected .gif.")
    images = [to_image(picture, width) for picture in pictures]
    write_whole(path, [_gif(images, round(100 * each_s) * _HUNDREDTH)])
    return path


def _gif(images: list[Image], milliseconds: int) -> bytes:
    from PIL.Image import Dither

    file = io.BytesIO()
    first, *others = [image.quantize(dither=Dither.NONE) for image in images]
    first.save(file, "GIF", save_all=True, append_images=others, duration=max(20, milliseconds), loop=0)
    return file.getvalue()
