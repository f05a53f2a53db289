"""Pictures as a Fluke would send them."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image


def jpeg_parts(pixels: np.ndarray) -> tuple[bytes, bytes]:
    """Header and scan of a JPEG file, the header up to the data, the scan with its 12 bytes of times."""
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=90)
    data = file.getvalue()
    at = data.index(b"\xff\xda")
    at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return data[:at], data[at:] + bytes(12)


def counted(data: bytes, order: str) -> bytes:
    return len(data).to_bytes(2, order) + data


def slope(width: int, height: int) -> np.ndarray:
    """(h, w) brightness that grows to the right and, a little, downwards."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return (200 * x / width + 40 * y / height).astype(np.uint8)
