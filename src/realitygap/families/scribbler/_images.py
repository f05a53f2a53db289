"""Conversion of the camera's bytes to arrays. Nothing here waits."""

from __future__ import annotations

import io
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap._image_file import eight_bits, open_image, plain
from realitygap.errors import ProtocolError

Pixels = NDArray[np.uint8]


class Size(NamedTuple):
    """Size of a picture [pixels]."""

    width: int
    height: int


FLUKE_1 = Size(256, 192)
FLUKE_2_LARGE = Size(1280, 800)
FLUKE_2_SMALL = Size(427, 266)
_NEAREST = 0
"""Pillow's number of its nearest filter."""
RUN_PIXELS = 4
"""Number of columns in a group. The runs of a blob picture count groups."""


def jpeg_pixels(header: bytes, scan: bytes, size: Size, *, gray: bool) -> Pixels:
    """Decode the two parts of a JPEG file to (h, w, 3) or, in gray, (h, w) uint8, stretched to the camera's size.

    A Fluke 1 describes half the width.

    Raises:
        ProtocolError: The bytes are no picture.
    """
    try:
        with open_image(io.BytesIO(header + scan[:-12]), 2 * max(size), ("JPEG",)) as file:
            picture = eight_bits(plain(file)).convert("L" if gray else "RGB")
    except (OSError, ValueError) as error:
        raise ProtocolError(f"The picture cannot be read ({error}): a byte was lost or added") from error
    if picture.size != size:
        picture = picture.resize(size, _NEAREST)
    return np.asarray(picture, np.uint8)


def raw_pixels(data: bytes, size: Size) -> Pixels:
    """Decode one byte a pixel, in the order V Y U Y along a row, to (h, w, 3) uint8."""
    rows = np.frombuffer(data, np.uint8).reshape(size.height, size.width).astype(np.float32)
    columns = np.arange(size.width)
    group = columns // RUN_PIXELS * RUN_PIXELS
    last = size.width - 1
    v = rows[:, group] - 128.0
    u = rows[:, np.minimum(group + 2, last)] - 128.0
    y = rows[:, np.minimum(columns | 1, last - (last + 1) % 2)]
    colors = np.stack([y + 1.402 * v, y - 0.344136 * u - 0.714136 * v, y + 1.772 * u], axis=-1)
    pixels: Pixels = np.clip(np.rint(colors), 0, 255).astype(np.uint8)
    return pixels


def gray_window_pixels(data: bytes, size: Size) -> Pixels:
    """Decode a window of every other pixel and row to (h, w) uint8."""
    window = np.frombuffer(data, np.uint8).reshape(size.height // 2, size.width // 2)
    return np.ascontiguousarray(window.repeat(2, axis=0).repeat(2, axis=1))


def run_pixels(data: bytes, size: Size, word: int) -> Pixels:
    """Decode run lengths to (h, w) uint8: 255 for pixels with the color. The first run is without the color.

    Args:
        data: Run after run, in groups of four columns.
        size: Size of the picture.
        word: Bytes of a run: 2 for a Fluke 1, 3 for a Fluke 2.
    """
    n_runs = len(data) // word
    runs = np.frombuffer(data[: n_runs * word], np.uint8).reshape(n_runs, word).astype(np.int64)
    lengths = runs @ (256 ** np.arange(word - 1, -1, -1))
    n_groups = -(-size.width // RUN_PIXELS) * size.height
    lengths = np.minimum(lengths, n_groups)
    flat = np.repeat(np.arange(n_runs) % 2 * 255, lengths)[:n_groups].astype(np.uint8)
    flat = np.pad(flat, (0, n_groups - len(flat)))
    return np.ascontiguousarray(flat.reshape(size.height, -1).repeat(RUN_PIXELS, axis=1)[:, : size.width])
