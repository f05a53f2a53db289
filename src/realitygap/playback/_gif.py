"""Pictures as a GIF: the same bytes every time, and small if little changes between pictures."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from PIL.Image import Image

_N_COLORS = 64
_UNCHANGED = _N_COLORS - 1
"""The color that lets the picture before show through."""


def gif_bytes(
    pictures: Sequence[Image],
    shown_cs: Sequence[int],
    colors: Sequence[tuple[int, int, int]],
    comment: str,
) -> bytes:
    """Return pictures of one size as a GIF that repeats from its beginning.

    Pixels that stay as they are are left out, and all pictures share one palette, so that nothing flickers.

    Args:
        pictures: Pictures in red, green and blue.
        shown_cs: Duration of each picture [1/100 s].
        colors: Colors that the palette must have, at most 40. Other colors are selected from the pictures.
        comment: Comment in the file.
    """
    from PIL import Image
    from PIL.GifImagePlugin import getdata

    palette = _palette(pictures, colors)
    width, height = pictures[0].size
    parts = [b"GIF89a", struct.pack("<HHBBB", width, height, 0xF5, 0, 0), palette.tobytes()]
    parts.append(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")
    parts.append(_comment(comment))
    nearest = _Nearest(palette)
    before: NDArray[np.uint8] | None = None
    for picture, shown in zip(pictures, shown_cs, strict=True):
        indices = nearest(np.asarray(picture))
        left, top, right, bottom = _changed(before, indices)
        part = indices[top:bottom, left:right]
        if before is not None:
            part = np.where(part == before[top:bottom, left:right], np.uint8(_UNCHANGED), part)
        before = indices
        image = Image.fromarray(np.ascontiguousarray(part))
        image.putpalette(palette.ravel().tolist())
        # disposal 1: the next picture is drawn over this one
        parts.append(b"\x21\xf9\x04" + struct.pack("<BHBB", 0x05, int(shown), _UNCHANGED, 0))
        parts += getdata(image, (left, top))
    return b"".join([*parts, b";"])


def _palette(pictures: Sequence[Image], colors: Sequence[tuple[int, int, int]]) -> NDArray[np.uint8]:
    """Return the given colors, and further ones from a few of the pictures, (_N_COLORS, 3)."""
    from PIL import Image

    last = len(pictures) - 1
    chosen = [pictures[k] for k in sorted({0, last // 3, 2 * last // 3, last})]
    width, height = chosen[0].size
    sheet = Image.new("RGB", (width, height * len(chosen)))
    for k, picture in enumerate(chosen):
        sheet.paste(picture, (0, k * height))
    own = list(dict.fromkeys(colors))
    n_found = _UNCHANGED - len(own)
    flat = (sheet.quantize(n_found).getpalette() or [])[: 3 * n_found]
    palette = np.zeros((_N_COLORS, 3), np.uint8)
    palette[: len(own)] = own
    palette[len(own) : len(own) + len(flat) // 3] = np.reshape(flat, (-1, 3))
    return palette


class _Nearest:
    """Finds the nearest color of a palette, the first of several as near; what was asked before is known."""

    def __init__(self, palette: NDArray[np.uint8]) -> None:
        self._palette = palette[:_UNCHANGED].astype(np.int32)
        self._known = np.full(1 << 24, _UNCHANGED, np.uint8)

    def __call__(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the index of the nearest color of each pixel (h, w, 3), (h, w)."""
        parts = pixels.astype(np.int32)
        packed = parts[..., 0] << 16 | parts[..., 1] << 8 | parts[..., 2]
        fresh = np.unique(packed[self._known[packed] == _UNCHANGED])
        there = np.stack([fresh >> 16, fresh >> 8 & 255, fresh & 255], axis=1)
        apart = there[:, None, :] - self._palette[None]
        self._known[fresh] = (apart * apart).sum(axis=2).argmin(axis=1)
        indices: NDArray[np.uint8] = self._known[packed]
        return indices


def _changed(before: NDArray[np.uint8] | None, now: NDArray[np.uint8]) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom of the changed part; one pixel if nothing changed."""
    if before is None:
        return 0, 0, now.shape[1], now.shape[0]
    rows, columns = np.nonzero(before != now)
    if len(rows) == 0:
        return 0, 0, 1, 1
    return int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1


def _comment(text: str) -> bytes:
    """Return a comment in blocks of at most 255 bytes."""
    raw = text.encode("utf-8")
    blocks = [raw[k : k + 255] for k in range(0, len(raw), 255)]
    return b"\x21\xfe" + b"".join(bytes([len(block)]) + block for block in blocks) + b"\x00"
