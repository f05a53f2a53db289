"""Images from files of any kind, as pixels of few kinds.

Pillow's `convert` cuts 16 bits off at 255 and drops transparency, without a word. So each image goes through `plain`.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from realitygap._limits import LimitError

if TYPE_CHECKING:
    from PIL.Image import Image

MOST_IMAGE_BYTES = 512 << 20
"""Maximum size of an image file: 8192 x 8192 pixels of 3 times 16 bits fit."""
KINDS = ("BMP", "GIF", "JPEG", "PNG", "PPM", "TGA", "TIFF", "WEBP")
"""Pillow's names of the formats that are read. Others start programs (EPS) or hold no pixels (WMF)."""
FULL_16 = 65535
"""White in 16 bits."""
_SCALES = {"1": 255, "L;2": 85, "L;4": 17}
"""Factors from the gray of 1, 2, and 4 bits to that of 8, by Pillow's names of their raw forms."""
_SIXTEEN_BIT_FORMATS = ("PPM", "PNG")
"""Formats whose 16 bits Pillow reads into 32."""


class UnknownImageError(ValueError):
    """A file is not an image of a known format."""


@contextlib.contextmanager
def open_image(source: Path | BinaryIO, most_side: int, kinds: tuple[str, ...] = KINDS) -> Iterator[Image]:
    """Open an image file, after a look at its size; inside the context all that a decoder raises is a ValueError.

    Args:
        source: The file.
        most_side: The largest width and height [px].
        kinds: Pillow's names of the formats that it may have.

    Raises:
        LimitError: It is larger.
        OSError: It cannot be read.
        UnknownImageError: It has none of the formats.
        ValueError: It is no whole image.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the size, which is checked here, and of odd entries
            with Image.open(source, formats=kinds) as image:
                if max(image.size) > most_side:
                    raise LimitError(
                        f"it is {image.width} x {image.height} pixels, expected at most {most_side} each way"
                    )
                yield image
    except Image.DecompressionBombError:
        raise LimitError(f"it has too many pixels, expected at most {most_side} each way") from None
    except UnidentifiedImageError:
        raise UnknownImageError(f"expected one of {', '.join(kinds)}") from None
    except (OSError, ValueError) as error:
        if isinstance(error, ValueError) or error.errno is not None:
            raise
        raise ValueError(f"it is no whole image ({error})") from None
    except Exception as error:  # a torn file makes decoders raise all kinds
        raise ValueError(f"it is no whole image ({error})") from None


def plain(image: Image) -> Image:
    """Return an image as L, LA, RGB, RGBA, or, if it is gray with 16 bits and not transparent, as I;16.

    Numbers with a fraction count from 0, black, to 1, white. Colors of 16 bits have 8 in Pillow.

    Args:
        image: Image as it was opened.

    Raises:
        ValueError: White is not known: numbers of 32 bits, or fractions outside 0 to 1.
    """
    tiles = getattr(image, "tile", None)  # only an image that was not loaded has them
    raw = str(tiles[0][3]) if tiles else ""
    image.load()
    if image.mode in ("F", "I") or image.mode.startswith("I;16"):
        return _deep(image)
    clear = image.info.get("transparency") if image.mode in ("1", "L", "RGB") else None
    if isinstance(clear, int) and raw in _SCALES:
        clear = min(clear * _SCALES[raw], 255)  # newer versions of Pillow scale that of 1 bit themselves
    elif isinstance(clear, tuple) and raw == "RGB;16B":
        clear = tuple(value >> 8 for value in clear)
    if image.mode == "1":
        image = image.convert("L")
    if clear is not None:
        image.info["transparency"] = clear
        return image.convert("LA" if image.mode == "L" else "RGBA")
    if image.mode in ("L", "LA", "RGB", "RGBA"):
        return image
    if image.mode == "La":
        return image.convert("LA")
    return image.convert("RGBA" if image.has_transparency_data else "RGB")


def _deep(image: Image) -> Image:
    """Return an image with more than 8 bits."""
    from PIL import Image as Images

    values = np.asarray(image)
    if image.mode == "F":
        if not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= 1):
            raise ValueError("its numbers are not from 0, black, to 1, white: save it with 8 or 16 bits")
        values = np.rint(values * FULL_16)
    elif image.mode == "I" and image.format not in _SIXTEEN_BIT_FORMATS:
        raise ValueError(
            "it has 32 bits a pixel, and which number is white is not known: save it with 8 or 16 bits"
        )
    gray = values.clip(0, FULL_16).astype(np.uint16)
    clear = image.info.get("transparency")
    if not isinstance(clear, int):
        return Images.fromarray(gray)
    return Images.merge(
        "LA", [eight_bits(Images.fromarray(gray)), Images.fromarray((gray != clear) * np.uint8(255))]
    )


def eight_bits(image: Image) -> Image:
    """Return an image that `plain` returned as L, LA, RGB, or RGBA."""
    from PIL import Image as Images

    if image.mode != "I;16":
        return image
    return Images.fromarray(((np.asarray(image, np.uint32) + 128) // 257).astype(np.uint8))


def on_white(image: Image) -> Image:
    """Return an image that `plain` returned as L or RGB, on white paper where it is transparent."""
    from PIL import Image as Images

    image = eight_bits(image)
    if image.mode not in ("LA", "RGBA"):
        return image
    clear = image.convert("RGBA")
    shown = Images.alpha_composite(Images.new("RGBA", clear.size, "white"), clear)
    return shown.convert("L" if image.mode == "LA" else "RGB")
