"""Reading a photograph or a scan."""

from __future__ import annotations

import errno
import hashlib
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from realitygap._image_file import UnknownImageError, eight_bits, on_white, open_image, plain
from realitygap._limits import LimitError, read_file
from realitygap.errors import VisionError

if TYPE_CHECKING:
    from PIL import Image

MOST_BYTES = 64 << 20
MOST_PIXELS = 120_000_000
ENOUGH_PIXELS = 30_000_000  # what has more is halved, which takes less memory and time
LEAST_SIDE, MOST_SIDE = 400, 20_000  # below, neither tags nor lines can be told; above, OpenCV gives up [px]
MOST_DECLARED = 1 << 31  # a side that a file declares [px]; sizes are checked with a better message
KINDS = ("JPEG", "PNG", "TIFF", "WEBP")


def read_photo(photo: str | Path | bytes) -> NDArray[np.uint8]:
    """Return a photograph or a scan in RGB, turned upright, (h, w, 3); a very large one at half its size.

    Args:
        photo: File, or its bytes: JPEG, PNG, TIFF or WebP.

    Raises:
        VisionError: It cannot be read, or is no such picture, or is too large or too small.
    """
    name = "The file" if isinstance(photo, bytes) else str(photo)
    data = photo_bytes(photo)
    if not data:
        raise VisionError(f"{name} is empty, expected a photograph of a sheet. Was it copied to the end?")
    try:
        with open_image(io.BytesIO(data), MOST_DECLARED, KINDS) as picture:
            _check_size(name, *picture.size)
            return _upright(picture)
    except VisionError:
        raise
    except UnknownImageError as error:
        raise VisionError(
            f"{name} is no picture that can be read: expected JPEG, PNG, TIFF or WebP.{_hint(data)}"
        ) from error
    except LimitError as error:
        raise VisionError(
            f"{name} has too many pixels, expected at most {MOST_PIXELS // 1_000_000} million."
        ) from error
    except (OSError, ValueError) as error:
        raise VisionError(f"{name} cannot be read as a picture: {error}. Is the file whole?") from error


def _check_size(name: str, width: int, height: int) -> None:
    is_fit = min(width, height) >= LEAST_SIDE and max(width, height) <= MOST_SIDE
    if not is_fit or width * height > MOST_PIXELS:
        raise VisionError(
            f"{name} has {width} x {height} pixels, expected {LEAST_SIDE} to {MOST_SIDE} each way and at most "
            f"{MOST_PIXELS // 1_000_000} million in all."
        )


def _upright(picture: Image.Image) -> NDArray[np.uint8]:
    """Return any kind of picture as (h, w, 3): gray, 16 bits deep, for print, with a palette or transparent."""
    from PIL import ImageOps

    turn = picture.getexif().get(ORIENTATION, 1)
    if _is_large(picture):
        picture.draft(None, (picture.width // 2, picture.height // 2))  # a JPEG file is read at half its size
    whole = eight_bits(plain(picture))
    if _is_large(whole):
        whole = whole.reduce(2)
    whole = on_white(whole).convert("RGB")  # as it is shown
    whole.getexif()[ORIENTATION] = turn
    return np.array(ImageOps.exif_transpose(whole))


ORIENTATION = 0x0112
"""The number of the Exif entry that says how the camera was held."""


def _is_large(picture: Image.Image) -> bool:
    return picture.width * picture.height > ENOUGH_PIXELS


def _hint(data: bytes) -> str:
    """Return advice for a HEIC or PDF file; empty for other files."""
    if data[4:8] == b"ftyp":
        return (
            " It looks like HEIC: export it as JPEG, or set the phone's camera to the most compatible format."
        )
    if data.startswith(b"%PDF"):
        return " It is a PDF: scan to JPEG or PNG."
    return ""


def is_gray(image: NDArray[np.uint8]) -> bool:
    """Return whether a picture (h, w, 3) has no colors."""
    some = image[::7, ::7].astype(np.int16)
    return bool((some.max(axis=2) - some.min(axis=2)).max() <= GRAY_SPREAD)


GRAY_SPREAD = 3
"""Channels of a gray picture differ by no more than this."""


def photo_bytes(photo: str | Path | bytes) -> bytes:
    """Return the bytes of a photograph's file.

    Raises:
        VisionError: It cannot be read, or is too large.
    """
    if isinstance(photo, bytes):
        data, name = photo, "The picture"
    else:
        name = str(photo)
        try:
            data = read_file(Path(photo), MOST_BYTES)
        except OSError as error:
            if error.errno == errno.EFBIG:
                raise VisionError(
                    f"{name} is larger than {MOST_BYTES >> 20} MiB, expected a photograph of a sheet."
                ) from None
            raise VisionError(
                f"{name} cannot be read: {error.strerror or error}. Name a photograph."
            ) from error
    if len(data) > MOST_BYTES:
        raise VisionError(f"{name} is larger than {MOST_BYTES >> 20} MiB, expected a photograph of a sheet.")
    return data


def photo_hash(data: bytes) -> str:
    """Return the SHA-256 of a photograph's file, by which a ledger knows it."""
    return hashlib.sha256(data).hexdigest()
